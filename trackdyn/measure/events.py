"""Events of a passage (Sect. 6.1) and the largest force of every visit: when arcs and ring touch, peak and let go."""

import numpy as np
import pandas as pd
import scipy

from trackdyn.measure.contacts import VISIT, contacts, passages
from trackdyn.model.arrays import SIDES
from trackdyn.simulation.recording import Recording

RESOLUTION = 0.01  # to which the paper prints the times of events, s
AFTER_TOUCH = "after the touch"
EVENTS_WITHOUT_RING = {
    "first left": ("left", "start_s"),
    "first right": ("right", "start_s"),
    "left maximum": ("left", "peak_s"),
    "right maximum": ("right", "peak_s"),
    "right gone": ("right", "end_s"),
    "out": ("arcs", "end_s"),
}
EVENTS_WITH_RING = {
    "ring touched": ("ring", "start_s"),
    "ring maximum": ("ring", "peak_s"),
    "left touches": ("left", "start_s"),
    "left maximum": ("left", "peak_s"),
    "ring left": ("ring", "end_s"),
    "out": ("arcs", "end_s"),
}


def peaks(recording: Recording, side: str) -> pd.DataFrame:
    """Largest force of every visit of an arc of one side to the sprocket, in order of release.

    Visits that the beginning of the record may cut are left out. A table with ``end_s`` since the beginning of the
    record and ``peak_n``.
    """
    rows = pd.DataFrame(contacts(recording))
    rows = rows[rows["lasting"] & (rows["side"] == SIDES.index(side))].sort_values(["connector", "start_s"])
    # an arc is on the sprocket for about half a turn, and off it for longer than that
    free = VISIT * recording.periods.turn
    visit = (rows["start_s"].diff().gt(free) | rows["connector"].diff().ne(0)).cumsum()
    visits = rows.groupby(visit).agg({"start_s": "min", "end_s": "max", "peak_n": "max"})
    return visits[visits["start_s"] > free].sort_values("end_s")[["end_s", "peak_n"]]


def passage_events(recording: Recording) -> pd.DataFrame:
    """Times of the events of every complete passage (`passages`), in the order of C16 (no ring) or C17 (ring).

    A row a passage, a column an event: s since the first contact of the passage, NaN for what does not happen. ``out``
    is the last contact of either arc.
    """
    events, times = EVENTS_WITHOUT_RING if recording.scene.ring_radius is None else EVENTS_WITH_RING, []
    for _, passage in passages(recording).groupby("passage"):
        rows, first = passage.set_index("side"), passage["start_s"].min()
        sides = {side: rows.loc[side] for side in SIDES} | {"arcs": rows.loc[["left", "right"]].max(numeric_only=True)}
        times.append({event: float(sides[side][column] - first) for event, (side, column) in events.items()})
    return pd.DataFrame(times, columns=list(events), dtype=float)


def mean_events(recording: Recording) -> pd.DataFrame:
    """Median, mean and standard deviation (1/(n-1)) of `passage_events` over the complete passages, then
    `smoothed_maxima`.

    A table with ``event, median_s, mean_s, sd_s`` and the ``passages`` in which it happens; NaN where none or only one
    does.
    """
    return pd.concat([_over_passages(passage_events(recording)), smoothed_maxima(recording)], ignore_index=True)


def _over_passages(times: pd.DataFrame) -> pd.DataFrame:
    columns = {"median_s": times.median(), "mean_s": times.mean(), "sd_s": times.std(), "passages": times.count()}
    return pd.DataFrame(columns).rename_axis("event").reset_index()


def event_times(recording: Recording) -> dict[str, float]:
    """Median time of every event of `mean_events` after the first contact, s; NaN if never."""
    return mean_events(recording).set_index("event")["median_s"].to_dict()


def smoothed_maxima(recording: Recording) -> pd.DataFrame:
    """Times of the largest force in two readings that leave out the spike of a touch-down, of the recorded connectors.

    The largest force of all steps may be that spike, which lasts less than a millisecond. The paper prints times to
    0.01 s and draws its forces every millisecond: a mean over `RESOLUTION` shows the maximum of what carries load, and
    so do the samples of the record from so long after the touch of that side on. A table as of `mean_events` with the
    ``area`` of the groove, the most frequent one (1 to 10; 0 on the ring).
    """
    count = recording.scene.rig.chain.pitches
    columns = {int(pitch): i for i, pitch in enumerate(recording.pitches)}
    window = max(round(RESOLUTION * recording.rate), 1)
    table = passages(recording)
    table = table[table["connector"].isin(columns)]
    times: dict[str, list[float]] = {}
    areas: dict[str, list[int]] = {}
    for _, rows in table.groupby("passage"):
        first, last = rows["start_s"].min(), rows["end_s"].max()
        connector, starts = int(rows["connector"].iloc[0]), rows.set_index("side")["start_s"]
        for i, side in enumerate(SIDES):
            column = columns.get(connector % count + 1 if side == "ring" else connector)
            if column is None or np.isnan(starts[side]):
                continue
            force = recording.force[:, column, i]
            smooth = scipy.ndimage.uniform_filter1d(force, window)
            touch = starts[side] + RESOLUTION
            for name, values, begin in ((f"mean over {RESOLUTION:g} s", smooth, first), (AFTER_TOUCH, force, touch)):
                inside = np.flatnonzero((recording.time >= begin) & (recording.time <= last))
                if len(inside):
                    highest = inside[np.argmax(values[inside])]
                    event = f"{side} maximum, {name}"
                    times.setdefault(event, []).append(float(recording.time[highest] - first))
                    areas.setdefault(event, []).append(0 if side == "ring" else int(recording.area[highest, column, i]))
    means = _over_passages(pd.DataFrame({event: pd.Series(values) for event, values in times.items()}))
    return means.assign(area=[np.bincount(areas[event]).argmax() for event in means["event"]])
