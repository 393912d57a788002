"""Measures of the whole loop: all links within one pitch passage replace one link over a revolution.

In steady motion each link repeats the motion of the link ahead of it one pitch passage later. If that were exact, the
record of one link over a revolution of the loop would be the records of all links over one passage, end to end
(`stitch`). Otherwise links and passages are samples: values are averaged over all links within a passage first, so that
the correlation between links does not matter, and the means of successive passages are combined in batches whose
scatter gives the standard error of the whole mean (`uncertainty.batch_error`).
"""

from collections.abc import Collection
from functools import partial
from itertools import pairwise

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.measure.catalogue import BY_COLUMN, NAMED, SCALES, SERIES, TOLERATED
from trackdyn.measure.spectra import high_passed
from trackdyn.measure.uncertainty import NAN, Estimate, Series, ratio_values
from trackdyn.model.arrays import RING_FRICTION, SIDES, SPROCKET_WORK, TOOTH_FRICTION
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.signals import normal_signal


def every_ay(recording: Recording) -> np.ndarray:
    """Return the (s, p) y acceleration of a sensor on each link (Eq. 40), in its range, g; `InputError` without."""
    if not recording.scene.every_link:
        raise InputError("recording: every_link is False; a scene with every_link=True has a sensor on every link")
    rig = recording.scene.rig
    return normal_signal(recording.mean[:, len(rig.sensors) :], rig, rig.first_sensor.range)


def passage_edges(recording: Recording, required: bool = True) -> np.ndarray:
    """Return the (m + 1,) edges of the m whole passages of a record, in samples; `InputError` if one is missing."""
    passage = recording.periods.passage
    if recording.seconds + 1e-6 * passage >= passage:  # not at rest, where it is not a number
        return np.rint(np.arange(int(recording.seconds / passage + 1e-6) + 1) * passage * recording.rate).astype(int)
    if required:
        raise InputError(f"recording: {recording.seconds:g} s are shorter than a passage of {passage:.4g} s")
    return np.zeros(1, int)


def revolution_samples(recording: Recording, first: int, links: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns (k,) of a revolution of one of ``links`` links, in the passage from a first sample on."""
    rate, span = recording.rate, recording.periods.passage
    time = np.arange(int(links * span * rate + 1e-6)) / rate
    segment = np.minimum((time / span).astype(int), links - 1)
    rows = first + np.rint((time - segment * span) * rate).astype(int)
    if rows.max() + 1 >= len(recording.time):
        raise InputError(f"recording: {recording.seconds:g} s are shorter than a passage of {span:.4g} s and a sample")
    # links are numbered against the motion: one passage later a link repeats the present motion of the next one
    return rows, (recording.scene.rig.first_sensor.pitch - 1 + segment) % links


def stitch(recording: Recording, first: int = 0, ay: np.ndarray | None = None) -> np.ndarray:
    """Return the (k,) y acceleration (g) of one link over a revolution from the records of all links in a passage.

    It begins at sample ``first``; ``ay`` is `every_ay` of the recording. Raises `InputError`: the record ends earlier.
    """
    ay = every_ay(recording) if ay is None else ay
    return ay[revolution_samples(recording, first, ay.shape[1])]


class Links:
    """Estimators of a record with every link, by passage; raises as `passage_edges`."""

    def __init__(self, recording: Recording) -> None:
        self.ay, self.edges, self.recording = every_ay(recording), passage_edges(recording), recording
        self.number = np.arange(len(self.edges) - 1)
        self.high_passed = partial(high_passed, rate_hz=recording.rate)

    def series(self, values: np.ndarray, root: bool = False) -> Series:
        """Return the series of the mean of ``values`` (s, ...) over passages; ``root``: the measure is its root."""
        return Series(np.array([values[a:b].mean() for a, b in pairwise(self.edges)]), self.number, root)

    def sd(self) -> Series:
        """Return the series of the standard deviation from the mean of the whole record, g."""
        square, mean = self.series(self.ay**2).values, self.series(self.ay).values
        return Series((square - 2 * mean.mean() * mean) + mean.mean() ** 2, self.number, True)

    def line(self) -> Series:
        """Return the series of the amplitude (g) of stitched revolutions at the frequency of the loop."""
        last = len(self.ay) - int(np.ceil(self.recording.periods.passage * self.recording.rate)) - 1
        revolutions = [stitch(self.recording, first, self.ay) for first in self.edges[:-1] if first < last]
        lines = [2 * abs((ay * np.exp(-2j * np.pi * np.arange(len(ay)) / len(ay))).mean()) for ay in revolutions]
        return Series(np.array(lines), self.number[: len(lines)])

    def share(self, side: str) -> Series:
        """Return the series of the number of arcs in contact over that of teeth: contact duration, % of a turn."""
        touching = (self.recording.force[:, :, SIDES.index(side)] > 0.0).sum(axis=1)
        return self.series(touching * (100.0 / self.recording.scene.rig.sprocket.teeth))

    def peaks(self, side: str) -> Series | None:
        """Return the series of the largest force (N) of an arc in a visit to the sprocket; None without contacts."""
        from trackdyn.measure.events import peaks  # pandas takes half a second, which runs do not need

        if not len(self.recording.contact_log) or not len(visits := peaks(self.recording, side)):
            return None
        passage = np.searchsorted(self.edges / self.recording.rate, visits["end_s"]) - 1
        return Series(visits["peak_n"].to_numpy(), passage)


def series(recording: Recording, names: Collection[str] = TOLERATED) -> dict[str, Series]:
    """Return the measures (`catalogue.TOLERATED`) of a record with every link, by passage, if they have values."""
    links = Links(recording)
    return {
        name: values._replace(scale=SCALES.get(NAMED[name].column.kind))
        for name, estimator in SERIES.items()
        if name in names and estimator and (values := estimator(links)) is not None
    }


def work_series(recording: Recording) -> dict[str, Series]:
    """Return the measures of `work_measures` by passage; empty without a whole passage."""
    turn, teeth = recording.periods.turn, recording.scene.rig.sprocket.teeth
    work = {"teeth_sliding_j": (TOOTH_FRICTION, 1), "ring_sliding_j": (RING_FRICTION, 1),
            "motor_power_w": (SPROCKET_WORK, 1 / turn)}  # fmt: skip
    edges = passage_edges(recording, required=False)
    rows = recording.energy[edges[edges < len(recording.energy)]]
    measures = {name: teeth * factor * np.diff(rows[:, entry]) for name, (entry, factor) in work.items()}
    return {name: Series(values, np.arange(len(values))) for name, values in measures.items()}


def work_measures(recording: Recording) -> dict[str, float]:
    """Return friction work on the teeth and on the ring per turn of the sprocket, J, and mean motor power, W.

    Each is followed by its standard error over passages of a pitch; NaN for a record without a whole passage.
    """
    values: dict[str, float] = {}
    for name, measure in work_series(recording).items():
        values[name], values[BY_COLUMN[name].column.error], _ = measure.estimate()
    return values


def mobilised_friction(recording: Recording) -> Estimate:
    """Return tangential over normal force of the ring on all links, absolute values integrated over whole passages (1).

    It is between 0 and the static friction, and compares its laws. NaN without a whole passage, or load on the ring.
    """
    edges = passage_edges(recording, required=False)
    if len(edges) < 2 or not recording.ring_force[: edges[-1]].any():
        return Estimate(NAN, NAN, NAN)
    normal, tangential = np.add.reduceat(recording.ring_force[: edges[-1]], edges[:-1]).T
    return Series(ratio_values(tangential, normal), np.arange(len(normal))).estimate()


def whole_loop(recording: Recording) -> dict[str, Estimate]:
    """Return the measures (`series`) over all links and the whole passages of a record in steady running."""
    return {name: measure.estimate() for name, measure in series(recording).items()}
