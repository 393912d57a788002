"""The whole loop as the sensor: what every link feels within one pitch passage stands for a revolution of one link.

In steady motion each link does what the link ahead of it did one pitch passage before. If that were exact, the record
of one link over a revolution of the loop would be the records of all links over one passage, end to end (`stitch`).
Where motion does not repeat, links and passages are samples: means over all links within a passage are formed first,
so that the correlation between links does not matter, and the means of successive passages are joined in batches whose
scatter gives the standard error of the whole mean (`uncertainty.batch_error`).
"""

from collections.abc import Collection
from itertools import pairwise

import numpy as np

from trackdyn.errors import InputError
from trackdyn.measure.sensor import readings
from trackdyn.measure.spectra import high_passed
from trackdyn.measure.uncertainty import RELATIVE, SHARES, Estimate, Series
from trackdyn.model.arrays import RING_FRICTION, SIDES, TOOTH_FRICTION
from trackdyn.simulation.recording import Recording


def every_ay(recording: Recording) -> np.ndarray:
    """(s, p) y acceleration that a sensor on each link reports (Eq. 40), in its range, g; `InputError` without."""
    if not recording.scene.every_link:
        raise InputError("recording: every_link is False; a scene with every_link=True has a sensor on every link")
    rig = recording.scene.rig
    return readings(recording.mean[:, len(rig.sensors) :], rig, rig.first_sensor.range)[..., 1]


def passage_edges(recording: Recording) -> np.ndarray:
    """(m + 1,) edges of the m whole passages of a record, in samples; `InputError` if it holds none."""
    passage = recording.periods.passage
    if not recording.seconds + 1e-6 * passage >= passage:
        raise InputError(f"recording: {recording.seconds:g} s hold no passage of {passage:.4g} s")
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


def series(recording: Recording, names: Collection[str] = RELATIVE + SHARES) -> dict[str, Series]:
    """Measures of a record with every link, passage by passage.

    They are, all of them by default: ``rms``, ``sd`` (g); ``line`` (amplitude at the loop's frequency of the stitched
    revolution, g); ``high_frequency`` (RMS at and above 20 Hz, g); ``left_share``, ``right_share``, ``ring_share`` (%
    of a sprocket turn); ``left_peak``, ``right_peak`` (N: the largest force of an arc on its way through the sprocket,
    if contacts are logged and that arc has some).
    """
    from trackdyn.measure.events import peaks  # with pandas: half a second that a run does without

    ay, edges, teeth = every_ay(recording), passage_edges(recording), recording.scene.rig.sprocket.teeth
    number = np.arange(len(edges) - 1)

    def means(values: np.ndarray) -> np.ndarray:
        """Means of the passages."""
        return np.array([values[a:b].mean() for a, b in pairwise(edges)])

    measures = {}
    if "rms" in names:
        measures["rms"] = Series(means(ay**2), number, True)
    if "sd" in names:
        mean = means(ay)
        measures["sd"] = Series((means(ay**2) - 2 * mean.mean() * mean) + mean.mean() ** 2, number, True)
    if "high_frequency" in names:
        measures["high_frequency"] = Series(means(high_passed(ay, recording.rate) ** 2), number, True)
    if "line" in names:
        room = len(ay) - int(np.ceil(recording.periods.passage * recording.rate)) - 1
        ways = [stitch(recording, first, ay) for first in edges[:-1] if first < room]
        # amplitude of one period a revolution
        lines = [2 * abs((ay * np.exp(-2j * np.pi * np.arange(len(ay)) / len(ay))).mean()) for ay in ways]
        measures["line"] = Series(np.array(lines), number[: len(lines)])
    for k, side in enumerate(SIDES):
        if (name := f"{side}_share") in names:
            # arcs that touch at an instant, over teeth, is the fraction of a sprocket turn that each of them touches
            measures[name] = Series(means((recording.force[:, :, k] > 0.0).sum(axis=1) * (100.0 / teeth)), number)
        if (name := f"{side}_peak") in names and len(recording.contact_log) and len(visits := peaks(recording, side)):
            passage = np.searchsorted(edges / recording.rate, visits["end_s"]) - 1
            measures[name] = Series(visits["peak_n"].to_numpy(), passage)
    return measures


def sliding_series(recording: Recording) -> dict[str, Series]:
    """``teeth_sliding_j`` and ``ring_sliding_j`` passage by passage (`sliding_work`); empty without a whole one."""
    work = {"teeth": TOOTH_FRICTION, "ring": RING_FRICTION}
    try:
        edges = passage_edges(recording)
    except InputError:
        edges = np.zeros(1, int)
    rows = recording.energy[edges[edges < len(recording.energy)]]
    by_turn = {f"{surface}_sliding_j": np.diff(rows[:, entry]) for surface, entry in work.items()}
    teeth = recording.scene.rig.sprocket.teeth
    return {name: Series(teeth * values, np.arange(len(values))) for name, values in by_turn.items()}


def sliding_work(recording: Recording) -> dict[str, float]:
    """Friction work on the teeth and on the ring, summed over all contacts, in one turn of the sprocket, J.

    Keys are ``teeth_sliding_j`` and ``ring_sliding_j``, and those of their standard errors by batch means over passages
    of a pitch; NaN for a record without a whole passage.
    """
    values: dict[str, float] = {}
    for name, measure in sliding_series(recording).items():
        value, error, _ = measure.estimate()
        values |= {name: value, name.replace("sliding", "sliding_error"): error}
    return values


def whole_loop(recording: Recording) -> dict[str, Estimate]:
    """Measures (`series`) over all links and the whole passages of a record in steady running."""
    return {name: measure.estimate() for name, measure in series(recording).items()}
