"""Contacts with the sprocket (Sect. 6): spells, passages, and what is measured on them.

A *passage* is one way of a connector around the sprocket: every contact of its two arcs with the teeth, and of the
adjacent link ahead of it with the ring. That link is pressed on the ring about half a pitch before the connector meets
its groove, and leaves it as much earlier, as the printed times have it (ring 4.05 to 5.48 s, left arc until 5.56 s);
the link behind would touch first and leave last. Phases count from the first contact of any kind of a passage, in turns
of the sprocket. Statistics are taken over complete passages: a record of no whole number of loop revolutions would
weigh contact and free running wrongly. A share is a mean over passages, a mean over a run the sum over passages divided
by their number and by the time of a revolution.

Turns are those that the sprocket made (`Recording.steady_time`): a motor does not hold the speed that is asked for.
"""

from typing import Any

import numpy as np
import pandas as pd
import scipy

from trackdyn.errors import InputError
from trackdyn.measure.contact_log import INTEGRALS, NAN, SIDES, VISIT, contacts, extreme, first_of_highest
from trackdyn.measure.uncertainty import batch_error, ratio_error
from trackdyn.model.constants import SPROCKET
from trackdyn.parameters.rig import Rig
from trackdyn.simulation.recording import Recording

# Areas that an arc visits for less than this share of a turn a passage do not count in the summary, %.
LEAST_SHARE = 0.1
# From this share of a turn on an arc counts as touching, %; a force that acts for less has no error of its own.
TOUCHING = 0.5
# columns that both tables have
EXTENT = (
    "start_s", "end_s", "touching_s", "share_pct", "phase_start", "phase_end", "ring_phase_start", "ring_phase_end",
)  # fmt: skip
FORCES = ("peak_n", "peak_s", "peak_phase", *INTEGRALS)
PASSAGE_COLUMNS = ["passage", "connector", "side", "areas", "count", *EXTENT, *FORCES]

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


def spells(recording: Recording, merge_gap_s: float | None = None) -> pd.DataFrame:
    """Uninterrupted contacts with the sprocket that began and ended within the record.

    Contacts of the same pitch, side and groove less than ``merge_gap_s`` apart count as one (chatter).
    Those that the beginning of the record cuts are dropped; those still open at its end are not logged.

    Parameters
    ----------
    recording : Recording
        Run with logged spells.
    merge_gap_s : float, optional
        s; 0 merges nothing. The default is 0.01 s at 115 rpm (`contact_log.SHORT`).

    Returns
    -------
    DataFrame
        Sorted by connector and start; times in s since the beginning of the record.

        - ``pitch``: 1-based, of the arc's connector or of the link on the ring; ``connector``: whose
          passage it belongs to, the one behind for a link
        - ``side``: left, right, ring; ``groove``: 1 to m, 0 for the ring; ``areas``: such as ``2,3``
        - ``start_s, end_s``; ``touching_s``: time in contact, without the merged gaps; ``share_pct``: the
          same in percent of a sprocket turn
        - ``phase_start, phase_end``: turns since the first contact of the passage
        - ``ring_phase_start, ring_phase_end``: the same in units of the ring contact of the passage, from
          its beginning; NaN without one
        - ``peak_n, peak_s``: largest force and when; ``impulse_ns, square_n2s``: integrals of the force and
          of its square
        - ``passage``: number of the complete passage, in order of first contact; -1 and NaN phases for one
          that the record may cut
    """
    rows: dict[str, Any] = contacts(recording, merge_gap_s)
    rows["share_pct"] = 100 * rows["touching"] / recording.periods.turn
    rows["areas"] = [_area_names(bits) for bits in rows["areas"]]
    rows["side"] = [SIDES[side] for side in rows["side"]]
    for name in ("pitch", "connector"):
        rows[name] = rows[name] + 1
    columns = ["pitch", "connector", "side", "groove", "areas", *EXTENT, "peak_n", "peak_s", *INTEGRALS, "passage"]
    texts = {"side": str, "areas": str}  # also where there is none
    return pd.DataFrame({name: pd.Series(rows[name], dtype=texts.get(name)) for name in columns})


def passages(recording: Recording) -> pd.DataFrame:
    """Complete passages: one row for each and side, with or without contact.

    Returns
    -------
    DataFrame
        ``passage`` (in order of first contact), ``connector``, ``side``, ``areas`` visited, ``count`` of spells;
        ``start_s, end_s, touching_s, share_pct, phase_start, phase_end, ring_phase_start, ring_phase_end, peak_n,
        peak_s, peak_phase, impulse_ns, square_n2s``: first start, last end and highest peak of the contacts that are
        not short (`contact_log.SHORT`), sums over all. Without contact sums and ``peak_n`` are 0, times and phases NaN.
    """
    turn = recording.periods.turn
    rows = contacts(recording)
    rows = {name: column[rows["passage"] >= 0] for name, column in rows.items()}
    number = rows["passage"]
    count = int(number.max(initial=-1)) + 1
    entry = len(SIDES) * number + rows["side"]
    size = len(SIDES) * count
    table: dict = {"passage": np.repeat(np.arange(count), len(SIDES)), "side": np.tile(SIDES, count)}
    lasting = rows["lasting"]
    for name in ("start_s", "phase_start", "ring_phase_start"):
        table[name] = extreme(np.fmin, rows[name][lasting], entry[lasting], size)
    for name in ("end_s", "phase_end", "ring_phase_end"):
        table[name] = extreme(np.fmax, rows[name][lasting], entry[lasting], size)
    for name in ("touching_s", *INTEGRALS):
        table[name] = np.bincount(entry, rows[name], size)
    table["share_pct"] = 100 * np.bincount(entry, rows["touching"], size) / turn
    table["count"] = np.bincount(entry, minlength=size)
    highest = np.flatnonzero(lasting)[first_of_highest(rows["peak_n"][lasting], entry[lasting])]
    table |= {"peak_n": np.zeros(size), "peak_s": np.full(size, NAN)}
    for name in ("peak_n", "peak_s"):
        table[name][entry[highest]] = rows[name][highest]
    first = np.repeat(extreme(np.fmin, rows["start"][lasting], number[lasting], count), len(SIDES))
    table["peak_phase"] = (recording.steady_time(table["peak_s"]) - first) / turn
    areas, connector = np.zeros(size, int), np.zeros(count, int)
    np.bitwise_or.at(areas, entry, rows["areas"])
    table["areas"] = np.array([_area_names(bits) for bits in areas], dtype=object)
    connector[number] = rows["connector"] + 1
    table["connector"] = np.repeat(connector, len(SIDES))
    return pd.DataFrame(table, columns=PASSAGE_COLUMNS).astype({"side": str, "areas": str})


def meshing_summary(recording: Recording) -> dict:
    """Shares, phases and forces of a run, as means over its complete passages.

    Returns
    -------
    dict
        For ``left``, ``right`` and ``ring``:

        - ``_share_pct, _share_error_pct``: time in contact, percent of a sprocket turn
        - ``_rms_n, _rms_error_n, _sd_n, _sd_error_n``: of the force on an appointed connector (link) over
          the whole run, free running included as zero; all connectors see the same statistics
        - ``_rms_contact_n, _rms_contact_error_n``: RMS over the time in contact alone
        - ``_peak_n, _peak_error_n``: mean of the largest force of each passage; ``_peak_largest_n``: the
          largest of all, which grows with the record and has no standard error: what it estimates depends on how many
          passages it is the largest of (Coles, Introduction to Statistical Modeling of Extreme Values, 2001, ch. 3)
        - ``_phase_start, _phase_end``: first touch and last release in turns since the first contact of
          the passage, means over the passages with such a contact; ``_phase_start_error, _phase_end_error``

        and ``left_areas, right_areas``: visited by the recorded connectors for 0.1 % of a turn or more a
        passage, such as ``2,3`` or ``none``; ``passages``: number of complete passages. Errors are
        standard errors by batch means over passages (`uncertainty`). Without a complete passage all other numbers are
        NaN and areas empty; without a contact of the kind shares and forces are 0 and phases NaN.
    """
    table = passages(recording)
    loop = recording.periods.loop
    summary: dict = {"passages": table["passage"].nunique()}
    for side in SIDES:
        rows = table[table["side"] == side]
        touching = rows["touching_s"].sum()
        quiet = 0.0 if len(rows) else NAN
        share = rows["share_pct"]
        values: dict[str, float | str] = {"share_pct": float(share.mean()), "share_error_pct": batch_error(share)[0]}
        values |= _run_statistics(rows["impulse_ns"] / loop, rows["square_n2s"] / loop)
        values |= _contact_rms(rows) if touching else {"rms_contact_n": quiet, "rms_contact_error_n": quiet}
        values |= {"peak_n": float(rows["peak_n"].mean()), "peak_error_n": batch_error(rows["peak_n"])[0]}
        values["peak_largest_n"] = float(rows["peak_n"].max())
        for name in ("phase_start", "phase_end"):
            known = rows[name].dropna()
            values |= {name: float(known.mean()), f"{name}_error": batch_error(known)[0]}
        if side != "ring":
            values["areas"] = _visited(recording, side) if len(rows) else ""
        summary |= {f"{side}_{name}": value for name, value in values.items()}
    return summary


def peaks(recording: Recording, side: str) -> pd.DataFrame:
    """Largest force of every visit of an arc of one side to the sprocket, in order of release.

    Visits that the beginning of the record may cut are left out. A table with ``end_s`` since the beginning of the
    record and ``peak_n``.
    """
    rows = pd.DataFrame(contacts(recording))
    rows = rows[rows["lasting"] & (rows["side"] == SIDES.index(side))].sort_values(["connector", "start"])
    # an arc is on the sprocket for about half a turn, and off it for longer than that
    free = VISIT * recording.periods.turn
    visit = (rows["start"].diff().gt(free) | rows["connector"].diff().ne(0)).cumsum()
    visits = rows.groupby(visit).agg(start=("start", "min"), end_s=("end_s", "max"), peak_n=("peak_n", "max"))
    return visits[visits["start"] > free].sort_values("end_s")[["end_s", "peak_n"]]


def events(recording: Recording, passage: int) -> dict[str, float]:
    """Named events of one complete passage (:func:`passages`), in the order of C16 (no ring) or C17 (ring).

    Times are in s since the first contact of the passage, NaN for what does not happen. ``out`` is the last contact of
    either arc. Raises `InputError` if the record holds no complete passage of this number.
    """
    table = passages(recording)
    count = table["passage"].nunique()
    if passage not in set(table["passage"]):
        raise InputError(f"passage {passage} is not among the {count} complete passages of the record")
    return _events(table[table["passage"] == passage], _event_places(recording))


def mean_events(recording: Recording) -> pd.DataFrame:
    """Mean and standard deviation (1/(n-1)) of :func:`events` over the complete passages.

    A table with ``event, mean_s, sd_s`` and the ``passages`` in which it happens; NaN where none or only one does.
    """
    table, places = passages(recording), _event_places(recording)
    events_of_passages = [_events(rows, places) for _, rows in table.groupby("passage")]
    times = pd.DataFrame(events_of_passages, columns=list(places), dtype=float)
    columns = {"mean_s": times.mean(), "sd_s": times.std(), "passages": times.count()}
    return pd.DataFrame(columns).rename_axis("event").reset_index()


def event_times(recording: Recording) -> dict[str, float]:
    """Mean time of every event of `mean_events` and `smoothed_maxima` after the first contact, s; NaN if never."""
    tables = (mean_events(recording), smoothed_maxima(recording))
    return {row["event"]: float(row["mean_s"]) for table in tables for _, row in table.iterrows()}


def smoothed_maxima(recording: Recording, window_s: float = RESOLUTION) -> pd.DataFrame:
    """Times of the largest force in two readings that leave out the spike of a touch-down, of the recorded connectors.

    The largest force of all steps may be that spike, which lasts less than a millisecond. The paper prints times to
    0.01 s and draws its forces every millisecond: a mean over ``window_s`` shows the maximum of what carries load, and
    so do the samples of the record from ``window_s`` after the touch of that side on. A table with ``event`` (``left
    maximum, mean over 0.01 s``, ``left maximum, after the touch``, ...), ``mean_s, sd_s`` after the first contact,
    ``passages`` and ``area`` of the groove, the most frequent one (1 to 10; 0 on the ring).
    """
    count = recording.scene.rig.chain.pitches
    columns = {int(pitch): i for i, pitch in enumerate(recording.pitches)}
    window = max(round(window_s * recording.rate), 1)
    table = passages(recording)
    table = table[table["connector"].isin(columns)]
    times: dict[str, list[float]] = {}
    areas: dict[str, list[int]] = {}
    for _, rows in table.groupby("passage"):
        first, last = rows["start_s"].min(), rows["end_s"].max()
        connector, of_side = int(rows["connector"].iloc[0]), rows.set_index("side")
        for i, side in enumerate(SIDES):
            column = columns.get(connector % count + 1 if side == "ring" else connector)
            if column is None or np.isnan(of_side.loc[side, "start_s"]):
                continue
            force = recording.force[:, column, i]
            smooth = scipy.ndimage.uniform_filter1d(force, window)
            touch = of_side.loc[side, "start_s"] + window_s
            for name, values, begin in ((f"mean over {window_s:g} s", smooth, first), (AFTER_TOUCH, force, touch)):
                inside = np.flatnonzero((recording.time >= begin) & (recording.time <= last))
                if len(inside):
                    highest = inside[np.argmax(values[inside])]
                    event = f"{side} maximum, {name}"
                    times.setdefault(event, []).append(float(recording.time[highest] - first))
                    areas.setdefault(event, []).append(0 if side == "ring" else int(recording.area[highest, column, i]))
    return pd.DataFrame(
        [{"event": event, "mean_s": np.mean(t), "sd_s": np.std(t), "passages": len(t),
          "area": np.bincount(areas[event]).argmax()} for event, t in times.items()],
        columns=["event", "mean_s", "sd_s", "passages", "area"],
    )  # fmt: skip


def _visited(recording: Recording, side: str) -> str:
    """Areas that the recorded connectors visit for the least share of a turn a passage or more."""
    shares = sampled_shares(recording.area[:, :, SIDES.index(side)], recording.wheel_rate, recording.scene.rig)
    return ",".join(str(area) for area in range(1, 11) if shares[area] >= LEAST_SHARE) or "none"


def sampled_shares(area: np.ndarray, wheel_rate: np.ndarray, rig: Rig) -> np.ndarray:
    """(11,) time that pitches are in each area, % of a turn of the sprocket a passage; NaN where it does not turn.

    Parameters
    ----------
    area : (s, p) integer array
        Area by sample and pitch, 0 without contact.
    wheel_rate : (s, w) array
        Rates of the wheels, rad/s: a sample counts by what the sprocket turned in it.
    rig : Rig
    """
    weight = abs(wheel_rate[:, SPROCKET])
    counted = np.bincount(area.ravel(), np.repeat(weight, area.shape[1]), 11)
    passed = weight.sum() * area.shape[1] * rig.sprocket.teeth / rig.chain.pitches
    return 100 * counted / passed if passed else np.full(11, NAN)


def area_shares(recording: Recording) -> dict[str, float]:
    """Time of an arc of a recorded connector in each area, % of a turn a passage: ``left_area_2_pct``."""
    measures: dict[str, float] = {}
    for k, side in enumerate(SIDES[:2]):
        shares = sampled_shares(recording.area[:, :, k], recording.wheel_rate, recording.scene.rig)
        measures |= {f"{side}_area_{area}_pct": float(shares[area]) for area in range(1, 11)}
    return measures


def _run_statistics(mean: pd.Series, square: pd.Series) -> dict[str, float]:
    """RMS and SD of a force over the run, from each passage's share of its mean and mean square.

    Their standard errors follow from those of the means to first order.
    """
    mean_force, mean_square = float(mean.mean()), float(square.mean())
    rms = mean_square**0.5
    sd = max(mean_square - mean_force**2, 0.0) ** 0.5 if len(mean) else NAN
    rms_error = batch_error(square)[0] / (2 * rms) if rms else rms
    sd_error = batch_error(square - 2 * mean_force * mean)[0] / (2 * sd) if sd else sd
    return {"rms_n": rms, "rms_error_n": rms_error, "sd_n": sd, "sd_error_n": sd_error}


def _contact_rms(rows: pd.DataFrame) -> dict[str, float]:
    """RMS of a force over the time in contact, and its standard error to first order."""
    rms = float((rows["square_n2s"].sum() / rows["touching_s"].sum()) ** 0.5)
    return {
        "rms_contact_n": rms,
        "rms_contact_error_n": ratio_error(rows["square_n2s"], rows["touching_s"]) / (2 * rms),
    }


def _event_places(recording: Recording) -> dict[str, tuple[str, str]]:
    return EVENTS_WITHOUT_RING if recording.scene.ring_radius is None else EVENTS_WITH_RING


def _events(rows: pd.DataFrame, places: dict[str, tuple[str, str]]) -> dict[str, float]:
    """Events from the three rows of a passage."""
    rows = rows.set_index("side")
    first = rows["start_s"].min()
    sides = {side: rows.loc[side] for side in SIDES} | {"arcs": rows.loc[["left", "right"]].max(numeric_only=True)}
    return {event: float(sides[side][column] - first) for event, (side, column) in places.items()}


def _area_names(bits: int) -> str:
    """``2,3`` for the bits of areas 2 and 3."""
    return ",".join(str(area) for area in range(1, 11) if bits >> (area - 1) & 1)
