"""The whole loop as the sensor: what every link feels within one pitch passage stands for a revolution of one link.

In steady motion each link does what the link ahead of it did one pitch passage before. If that were exact, the record
of one link over a revolution of the loop would be the records of all links over one passage, end to end (`stitch`).
Where motion does not repeat, links and passages are samples: means over all links within a passage are formed first,
so that the correlation between links does not matter, and the means of successive passages are joined in batches whose
scatter gives the standard error of the whole mean (`uncertainty.batch_error`).
"""

from collections.abc import Callable, Collection
from functools import partial
from itertools import pairwise

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.measure.catalogue import BY_COLUMN, NAMED, SCALES, TOLERATED
from trackdyn.measure.sensor import readings
from trackdyn.measure.spectra import high_passed
from trackdyn.measure.uncertainty import NAN, Estimate, Series, ratio_values
from trackdyn.model.arrays import RING_FRICTION, SIDES, SPROCKET_WORK, TOOTH_FRICTION
from trackdyn.simulation.recording import Recording


def every_ay(recording: Recording) -> np.ndarray:
    """(s, p) y acceleration that a sensor on each link reports (Eq. 40), in its range, g; `InputError` without."""
    if not recording.scene.every_link:
        raise InputError("recording: every_link is False; a scene with every_link=True has a sensor on every link")
    rig = recording.scene.rig
    return readings(recording.mean[:, len(rig.sensors) :], rig, rig.first_sensor.range)[..., 1]


def passage_edges(recording: Recording) -> np.ndarray:
    """(m + 1,) edges of the m whole passages of a record, in samples; `InputError` if it holds none."""
    edges = _edges(recording)
    if len(edges) < 2:
        passage = recording.periods.passage
        raise InputError(f"recording: {recording.seconds:g} s hold no passage of {passage:.4g} s")
    return edges


def _edges(recording: Recording) -> np.ndarray:
    """As `passage_edges`; a record without a whole passage has one edge."""
    passage = recording.periods.passage
    if not recording.seconds + 1e-6 * passage >= passage:  # also at rest, where it is not a number
        return np.zeros(1, int)
    edges = np.arange(int(recording.seconds / passage + 1e-6) + 1) * passage
    return np.rint(edges * recording.rate).astype(int)


def revolution_samples(recording: Recording, first: int, links: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (k,) of the samples that make a revolution of one of ``links`` links.

    They lie within the passage from sample ``first`` on. Raises `InputError` if the record is shorter than a passage
    and a sample from there on.
    """
    rate, span = recording.rate, recording.periods.passage
    time = np.arange(int(links * span * rate + 1e-6)) / rate
    segment = np.minimum((time / span).astype(int), links - 1)
    rows = first + np.rint((time - segment * span) * rate).astype(int)
    if rows.max() + 1 >= len(recording.time):
        raise InputError(f"recording: {recording.seconds:g} s are shorter than a passage of {span:.4g} s and a sample")
    # links are numbered against the motion: one passage later a link does what the next one does now
    return rows, (recording.scene.rig.first_sensor.pitch - 1 + segment) % links


def stitch(recording: Recording, first: int = 0, ay: np.ndarray | None = None) -> np.ndarray:
    """(k,) y acceleration (g) of one link over a revolution, out of the records of all links within a passage.

    The passage begins at sample ``first``. The scene has ``every_link``; ``ay`` is `every_ay` of the recording, if it
    is at hand. Raises `InputError` as `revolution_samples`.
    """
    ay = every_ay(recording) if ay is None else ay
    return ay[revolution_samples(recording, first, ay.shape[1])]


class Links:
    """What measures of a record with every link are taken from, passage by passage; refuses as `passage_edges`."""

    def __init__(self, recording: Recording) -> None:
        self.ay, self.edges, self.recording = every_ay(recording), passage_edges(recording), recording
        self.number = np.arange(len(self.edges) - 1)
        self.high_passed = partial(high_passed, rate_hz=recording.rate)

    def series(self, values: np.ndarray, root: bool = False, statistic: Callable = np.mean) -> Series:
        """A measure whose passages have a statistic of ``values`` (s, ...), or the root of it."""
        return Series(np.array([statistic(values[a:b]) for a, b in pairwise(self.edges)]), self.number, root)

    def sd(self) -> Series:
        """Deviation from the mean of the whole record, g."""
        square, mean = self.series(self.ay**2).values, self.series(self.ay).values
        return Series((square - 2 * mean.mean() * mean) + mean.mean() ** 2, self.number, True)

    def line(self) -> Series:
        """Amplitude at the loop's frequency of the stitched revolution, g: one period a revolution."""
        room = len(self.ay) - int(np.ceil(self.recording.periods.passage * self.recording.rate)) - 1
        ways = [stitch(self.recording, first, self.ay) for first in self.edges[:-1] if first < room]
        lines = [2 * abs((ay * np.exp(-2j * np.pi * np.arange(len(ay)) / len(ay))).mean()) for ay in ways]
        return Series(np.array(lines), self.number[: len(lines)])

    def share(self, side: str) -> Series:
        """Arcs that touch at an instant, over teeth: the fraction of a sprocket turn that each of them touches, %."""
        touching = (self.recording.force[:, :, SIDES.index(side)] > 0.0).sum(axis=1)
        return self.series(touching * (100.0 / self.recording.scene.rig.sprocket.teeth))

    def peaks(self, side: str) -> Series | None:
        """The largest force (N) of an arc on its way through the sprocket, if contacts are logged and it has some."""
        from trackdyn.measure.events import peaks  # with pandas: half a second that a run does without

        if not len(self.recording.contact_log) or not len(visits := peaks(self.recording, side)):
            return None
        passage = np.searchsorted(self.edges / self.recording.rate, visits["end_s"]) - 1
        return Series(visits["peak_n"].to_numpy(), passage)


def series(recording: Recording, names: Collection[str] = TOLERATED) -> dict[str, Series]:
    """Measures (`catalogue.TOLERATED`) of a record with every link, passage by passage; those that have values."""
    links = Links(recording)
    taken = {name: take(links) for name, measure in NAMED.items() if name in names and (take := measure.series)}
    return {name: one._replace(scale=SCALES.get(NAMED[name].kind)) for name, one in taken.items() if one is not None}


def work_series(recording: Recording) -> dict[str, Series]:
    """Measures of `work_measures` passage by passage; empty without a whole one."""
    turn = recording.periods.turn
    work = {"teeth_sliding_j": (TOOTH_FRICTION, 1), "ring_sliding_j": (RING_FRICTION, 1),
            "motor_power_w": (SPROCKET_WORK, 1 / turn)}  # fmt: skip
    edges = _edges(recording)
    rows = recording.energy[edges[edges < len(recording.energy)]]
    teeth = recording.scene.rig.sprocket.teeth
    taken = {name: teeth * factor * np.diff(rows[:, entry]) for name, (entry, factor) in work.items()}
    return {name: Series(values, np.arange(len(values))) for name, values in taken.items()}


def work_measures(recording: Recording) -> dict[str, float]:
    """Friction work on the teeth and on the ring in one turn of the sprocket, J, and mean motor power, W.

    Keys are ``teeth_sliding_j``, ``ring_sliding_j`` and ``motor_power_w``, and those of their standard errors by batch
    means over passages of a pitch; NaN for a record without a whole passage.
    """
    values: dict[str, float] = {}
    for name, measure in work_series(recording).items():
        value, error, _ = measure.estimate()
        values |= {name: value, BY_COLUMN[name].error: error}
    return values


def mobilised_friction(recording: Recording) -> Estimate:
    """Tangential over normal force of the ring on all links, both by size and integrated over whole passages (1).

    It is the coefficient of friction in use, between 0 and the static one, and compares laws of friction that have no
    number in common. NaN without a whole passage, or for a ring that carries nothing.
    """
    edges = _edges(recording)
    if len(edges) < 2 or not recording.ring_force[: edges[-1]].any():
        return Estimate(NAN, NAN, NAN)
    normal, tangential = np.add.reduceat(recording.ring_force[: edges[-1]], edges[:-1]).T
    return Series(ratio_values(tangential, normal), np.arange(len(normal))).estimate()


def whole_loop(recording: Recording) -> dict[str, Estimate]:
    """Measures (`series`) over all links and the whole passages of a record in steady running."""
    return {name: measure.estimate() for name, measure in series(recording).items()}
