"""Events of a passage (Sect. 6.1): first contact, largest force and release of arcs and ring."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import scipy  # subpackages are loaded at first use: `scipy.signal` takes most of a second

from trackdyn.measure.contacts import VISIT, contacts, passage_arrays
from trackdyn.model.arrays import SIDES
from trackdyn.simulation.recording import Recording

LIKE_HEIGHT = 0.85  # of the largest force: within 15 %, the share below which an effect is practically none
RESOLUTION = 0.01  # of the paper's times of events, s
FLIGHT = 0.1  # turns of the sprocket: longer than the flight of an arc after an impact that rebounds
EVENTS_WITHOUT_RING = {
    "first left": ("left", "start_s"), "first right": ("right", "start_s"), "left maximum": ("left", "peak_s"),
    "right maximum": ("right", "peak_s"), "right gone": ("right", "end_s"), "out": ("arcs", "end_s"),
}  # fmt: skip
EVENTS_WITH_RING = {
    "ring touched": ("ring", "start_s"), "ring maximum": ("ring", "peak_s"), "left touches": ("left", "start_s"),
    "left maximum": ("left", "peak_s"), "ring left": ("ring", "end_s"), "out": ("arcs", "end_s"),
}  # fmt: skip


def peaks(recording: Recording, side: str) -> pd.DataFrame:
    """Return ``end_s`` and ``peak_n`` of every visit of an arc of one side to the sprocket, in order of release.

    Visits that an end of the record may cut are left out: contacts that are still open are not logged, and the rest of
    such a visit may be an impact that rebounded.
    """
    rows, turn = pd.DataFrame(contacts(recording)), recording.periods.turn
    rows = rows[rows["side"] == SIDES.index(side)].sort_values(["connector", "start_s"])
    # an arc is on the sprocket for about half a turn, and off it for longer than that
    free = VISIT * turn
    visit = (rows["start_s"].diff().gt(free) | rows["connector"].diff().ne(0)).cumsum()
    visits = rows.groupby(visit).agg({"connector": "first", "start_s": "min", "end_s": "max", "peak_n": "max"})
    touching = recording.pitches[recording.force[-1:, :, SIDES.index(side)].any(axis=0)] - 1  # no sample, no contact
    latest = visits["start_s"] > recording.seconds - free
    cut = latest & (visits["connector"].isin(touching) | visits["end_s"].gt(recording.seconds - FLIGHT * turn))
    return visits[(visits["start_s"] > free) & ~cut].sort_values("end_s")[["end_s", "peak_n"]]


def passage_events(recording: Recording) -> pd.DataFrame:
    """Return times of events (columns) since the first contact of complete passages (rows), s; NaN without an event."""
    events = EVENTS_WITHOUT_RING if recording.scene.ring_radius is None else EVENTS_WITH_RING
    table = passage_arrays(recording)
    first = np.fmin.reduce(table["start_s"], axis=1)
    at = {column: dict(zip(SIDES, table[column].T, strict=True)) for column in ("start_s", "peak_s", "end_s")}
    at["end_s"]["arcs"] = np.fmax(at["end_s"]["left"], at["end_s"]["right"])
    return pd.DataFrame({event: at[column][side] - first for event, (side, column) in events.items()}, dtype=float)


def mean_events(recording: Recording) -> pd.DataFrame:
    """Return statistics of `passage_events` over complete passages, then `smoothed_maxima`."""
    return pd.concat([_over_passages(passage_events(recording)), smoothed_maxima(recording)], ignore_index=True)


def _over_passages(times: pd.DataFrame) -> pd.DataFrame:
    """Return ``event, median_s, mean_s, sd_s`` (1/(n-1)) and the ``passages`` in which it occurs; NaN for too few."""
    columns = {"median_s": times.median(), "mean_s": times.mean(), "sd_s": times.std(), "passages": times.count()}
    return pd.DataFrame(columns).rename_axis("event").reset_index()


def _forces(recording: Recording) -> Iterator[tuple[int, float, float, slice, int, np.ndarray]]:
    """Yield side, its passage's first contact and its own (s), samples, column of the record and smoothed force (N)."""
    rig, width = recording.scene.rig, max(round(RESOLUTION * recording.rate), 1)
    columns = {int(pitch): i for i, pitch in enumerate(recording.pitches)}
    smoothed = scipy.ndimage.uniform_filter1d(recording.force, width, axis=0)
    table = passage_arrays(recording)
    for connector, starts, ends in zip(table["connector"][:, 0], table["start_s"], table["end_s"], strict=True):
        first, last = np.fmin.reduce(starts), np.fmax.reduce(ends)
        for i in range(len(SIDES)):
            column = columns.get(rig.link_ahead(connector) if SIDES[i] == "ring" else connector)
            if connector in columns and column is not None and not np.isnan(starts[i]):
                begin, end = np.searchsorted(recording.time, first), np.searchsorted(recording.time, last, "right")
                samples = slice(int(begin), int(end))
                yield i, float(first), float(starts[i]), samples, column, smoothed[:, column, i]


def smoothed_maxima(recording: Recording) -> pd.DataFrame:
    """Return times of the largest force without the spike of the first contact, by two definitions.

    The largest force of all steps may be that spike, which lasts less than a millisecond. The paper prints times to
    0.01 s and draws its forces every millisecond: a mean over `RESOLUTION` shows the maximum of the load, and so do the
    samples from `RESOLUTION` after the first contact of that side on. The table is that of `mean_events`, with the most
    frequent ``area`` of the groove (1 to 10; 0 on the ring).
    """
    times: dict[str, list[float]] = {}
    areas: dict[str, list[int]] = {}
    for i, first, touch, samples, column, smooth in _forces(recording):
        side, force = SIDES[i], recording.force[:, column, i]
        loaded = max(samples.start, int(np.searchsorted(recording.time, touch + RESOLUTION)))
        definitions = ((f"mean over {RESOLUTION:g} s", smooth, samples.start), ("after the touch", force, loaded))
        for name, values, begin in definitions:
            if begin < samples.stop:
                highest = begin + np.argmax(values[begin : samples.stop])
                event = f"{side} maximum, {name}"
                times.setdefault(event, []).append(float(recording.time[highest] - first))
                areas.setdefault(event, []).append(0 if side == "ring" else int(recording.area[highest, column, i]))
    means = _over_passages(pd.DataFrame({event: pd.Series(values) for event, values in times.items()}))
    return means.assign(area=[np.bincount(areas[event]).argmax() for event in means["event"]])


def like_peaks(recording: Recording) -> pd.DataFrame:
    """Return peaks that are nearly the largest force of a side: further definitions of its time.

    A force that peaks once per pitch has several maxima of like height, and a little damping decides which is the
    largest. The peaks are those of the mean over `RESOLUTION`, averaged over the passages, half a pitch apart or more,
    that reach `LIKE_HEIGHT` of the largest. The table is that of `mean_events`, without scatter.
    """
    series: dict[int, list[np.ndarray]] = {}
    for i, _, _, samples, _, smooth in _forces(recording):
        series.setdefault(i, []).append(smooth[samples])
    apart = max(recording.periods.turn / recording.scene.rig.sprocket.teeth / 2 * recording.rate, 1)
    rows = []
    for i, forces in sorted(series.items()):
        mean = np.mean([force[: min(map(len, forces))] for force in forces], axis=0)
        padded = np.r_[0.0, mean, 0.0]  # a force that begins or ends at its maximum has a peak there
        peaks = scipy.signal.find_peaks(padded, height=LIKE_HEIGHT * padded.max(), distance=apart)[0] - 1
        for number, time in enumerate(peaks / recording.rate, 1):
            rows.append([f"{SIDES[i]} maximum, peak {number} of like height", time, time, np.nan, len(forces)])
    return pd.DataFrame(rows, columns=["event", "median_s", "mean_s", "sd_s", "passages"])
