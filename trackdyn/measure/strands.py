"""Tension of the strands, the parts of the chain between two wheels."""

import numpy as np

from trackdyn.parameters.layout import belt_path


class Strands:
    """The strands of a loop on its wheels, where the wheels are now.

    Parameters
    ----------
    circles : (w, 3) array
        Centres of the wheels and radii of the pins' path on them, m, in the order in which the chain meets them.
    names : list of str
        Of the wheels, in the same order.

    Attributes
    ----------
    names : list of (str, str)
        Wheels that a strand leaves and reaches.
    middle, along : (w, 2) arrays
        Middle of each strand (m) and its direction.
    """

    def __init__(self, circles, names):
        path = belt_path(circles, names, overlap=True)
        self.names = [(name, names[(i + 1) % len(names)]) for i, name in enumerate(names)]
        self.along = np.column_stack([np.cos(path.heading), np.sin(path.heading)])
        self.middle = path.along(0.5 * (path.start[1::2] + path.start[2::2]))[0]

    def tension(self, pins, forces) -> np.ndarray:
        """(w,) force in the chain in the middle of each strand, N.

        A value between those of the joints before and behind the middle, by their places along the strand: it does not
        jump when another joint comes nearest. The chain may sag by less than half the way to its other strand.

        Parameters
        ----------
        pins : (n, 2) array
            Joints, m.
        forces : (n, 2) array
            Force in each, N.
        """
        size, n = np.hypot(*np.transpose(forces)), len(pins)
        found = np.empty(len(self.middle))
        for k, (middle, along) in enumerate(zip(self.middle, self.along, strict=True)):
            away = pins - middle
            near = (np.argmin(np.hypot(*away.T)) + np.arange(-1, 2)) % n
            found[k] = np.interp(0.0, away[near] @ along, size[near])  # joints are numbered along the run
        return found
