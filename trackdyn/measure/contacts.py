"""Contacts with the sprocket (Sect. 6): intervals, passages, and their statistics.

A *passage* is the path of a connector around the sprocket: all contacts of its two arcs with the teeth, and of the
adjacent link ahead of it with the ring. That link is pressed on the ring about half a pitch before the connector meets
its groove, and leaves it as much earlier, in agreement with the printed times (ring 4.05 to 5.48 s, left arc until
5.56 s); the link behind would touch first and leave last. Phases count from the first contact of a passage, in turns of
the sprocket. Statistics are over complete passages: a record of no whole number of loop revolutions would give contact
and free running wrong weights. A share is a mean over passages; a mean over a run is the sum over passages divided by
their number and by the time of a revolution.
"""

from typing import TYPE_CHECKING

import numpy as np

from trackdyn.measure.uncertainty import NAN
from trackdyn.model.arrays import CONTACT_INTERVAL, SIDES
from trackdyn.rig.rig import Rig
from trackdyn.simulation.recording import Recording

if TYPE_CHECKING:
    import pandas as pd  # imported where tables are made: it takes longer than to load all kernels

# Turns of the sprocket: 0.01 s, the resolution of the paper's times, of the 2.906 s of a turn at 115 rpm. Shorter gaps
# do not separate contacts; shorter contacts give no times. Their forces count like any other: an impact that rebounds
# after 0.65 ms may be the largest of a passage.
SHORT = 0.01 / 2.906
# Longest contact of a passage and longest pause in it, turns of the sprocket: the chain leaves the sprocket after about
# half a turn. Passages nearer to an end of the record may be incomplete.
LONGEST_CONTACT = 2 / 3
PASSAGE = 0.6  # turns of the sprocket from the first to the last contact of a passage
VISIT = 0.7  # turns of the sprocket from the start of a visit of an arc to the next one at least
INTEGRALS = ("impulse_ns", "square_n2s")


def contacts(recording: Recording) -> dict[str, np.ndarray]:
    """Return the contacts with the sprocket that began and ended within the record, sorted by connector and start.

    Contacts of the same pitch, side and groove less than `SHORT` apart are merged (chatter). Those that began before
    the record are dropped; those still open at its end are not logged. The (k,) arrays are, by name:

    - ``pitch``: from 0, of the arc's connector or of the link on the ring; ``connector``: of the passage, for a link
      the one behind; ``side``: index in `SIDES`; ``groove``: 1 to m, 0 for the ring; ``areas``: bits
    - ``start_s, end_s``: since the beginning of the record; ``touching_s``: time in contact, without merged gaps
    - ``lasting``: true if not shorter than `SHORT`; ``phase_start, phase_end``: turns since the first lasting contact
      of the passage; ``passage``: number of the complete passage, in order of first contact; -1 and NaN phases for
      passages that the record may cut
    - ``peak_n, peak_s``: largest force and its time; ``impulse_ns, square_n2s``: integrals of force and its square
    """
    short = SHORT * recording.periods.turn
    rows = _merged(recording, short)
    rows["lasting"] = rows["end_s"] - rows["start_s"] >= short
    ring, pitches = SIDES.index("ring"), recording.scene.rig.chain.pitches
    rows["connector"] = np.where(rows["side"] == ring, (rows["pitch"] - 1) % pitches, rows["pitch"])
    order = np.lexsort((rows["side"], rows["start_s"], rows["connector"]))
    rows = {name: column[order] for name, column in rows.items()}
    number, first = _number_passages(rows, recording)
    for end in ("start", "end"):
        rows[f"phase_{end}"] = (rows[f"{end}_s"] - first) / recording.periods.turn
    return rows | {"passage": number}


def gathered(reduce: np.ufunc, values, index: tuple[np.ndarray, ...], shape: tuple[int, ...], empty=0.0) -> np.ndarray:
    """Reduce values of equal index by a ufunc, such as ``np.add``, into a new array; ``empty`` without values."""
    array = np.full(shape, empty)
    reduce.at(array, index, values)
    return array


def first_of_highest(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Return the index of the largest value of every group, the first of equal ones."""
    order = np.lexsort((-values, group))
    return order[np.flatnonzero(np.diff(group[order], prepend=-1))]


def _merged(recording: Recording, gap: float) -> dict[str, np.ndarray]:
    """Return the columns of the log with cut contacts removed, chatter merged, times since the record's beginning."""
    # contacts that began earlier are logged from the first step of the record on
    begin = recording.begin + 1.5 * recording.scene.time_step
    begun = recording.contact_log[recording.contact_log["start_s"] > begin]
    begun = begun[np.lexsort([begun[name] for name in ("start_s", "groove", "side", "pitch")])]
    integers, times = ("pitch", "side", "groove", "areas"), ("start_s", "end_s", "peak_s")
    log = {name: begun[name] for name in CONTACT_INTERVAL.names or ()}
    log |= {name: log[name].astype(int) for name in integers}
    log |= {name: log[name] - recording.begin for name in times}
    log["touching_s"] = log["end_s"] - log["start_s"]
    begins = np.ones(len(begun), bool)
    same = np.all([np.diff(log[name]) == 0 for name in integers[:3]], axis=0)
    begins[1:] = ~(same & (log["start_s"][1:] - log["end_s"][:-1] < gap))
    first = np.flatnonzero(begins)
    rows = {name: log[name][begins] for name in (*integers[:3], "start_s")}
    rows["end_s"] = log["end_s"][np.roll(begins, -1)]
    rows |= {name: np.add.reduceat(log[name], first) for name in ("touching_s", *INTEGRALS)}
    rows["areas"] = np.bitwise_or.reduceat(log["areas"], first)
    highest = first_of_highest(log["peak_n"], np.cumsum(begins))
    return rows | {name: log[name][highest] for name in ("peak_n", "peak_s")}


def _number_passages(rows: dict[str, np.ndarray], recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the complete passage (or -1) of rows by connector and start, and its first lasting contact (or NaN)."""
    start, end, connector, period = rows["start_s"], rows["end_s"], rows["connector"], recording.periods
    if not len(start):
        return np.zeros(0, int), np.zeros(0)
    pause = 0.5 * (period.loop - 0.5 * period.turn)  # half the time that a connector runs free in a revolution
    apart = connector * 2 * (end.max() + pause)  # so that the latest end so far is one of the same connector
    begins = np.append(True, (start + apart)[1:] - np.maximum.accumulate(end + apart)[:-1] > pause)
    group, index = np.cumsum(begins) - 1, np.flatnonzero(begins)
    first, last = np.minimum.reduceat(start, index), np.maximum.reduceat(end, index)
    margin = LONGEST_CONTACT * period.turn
    complete = np.flatnonzero((first >= margin) & (last <= recording.seconds - margin))
    number = np.full(len(index), -1)
    number[complete[np.argsort(first[complete], kind="stable")]] = np.arange(len(complete))
    lasting = rows["lasting"]
    began = gathered(np.fmin, start[lasting], (group[lasting],), index.shape, NAN)
    return number[group], np.where(number >= 0, began, NAN)[group]


TOUCHING = 0.5  # least share of a turn, %, for a stopping criterion on the force
PASSAGE_COLUMNS = [
    "passage", "connector", "side", "areas", "count", "start_s", "end_s", "touching_s", "share_pct", "phase_start",
    "phase_end", "peak_n", "highest_s", "peak_s", *INTEGRALS,
]  # fmt: skip


def passages(recording: Recording) -> "pd.DataFrame":
    """Return complete passages: one row per passage and side, with or without contact, in order of first contact.

    Columns are ``PASSAGE_COLUMNS``: those of `contacts`, and their ``count``. Sums, the largest force ``peak_n`` and
    its time ``highest_s`` are of all contacts (0 without any, times NaN); ``start_s``, ``end_s`` and ``peak_s``, the
    time of the largest force among them, are of lasting contacts, as the paper prints times.
    """
    import pandas as pd

    table = {name: column.ravel() for name, column in passage_arrays(recording).items()}
    return pd.DataFrame(table, columns=PASSAGE_COLUMNS).astype({"side": str, "areas": str})


def passage_arrays(recording: Recording) -> dict[str, np.ndarray]:
    """Return the columns of `passages` as (m, 3) arrays, sides as in `SIDES`."""
    turn, rows = recording.periods.turn, contacts(recording)
    rows = {name: column[rows["passage"] >= 0] for name, column in rows.items()}
    number, lasting, connectors = rows["passage"], rows["lasting"], rows["connector"] + 1
    shape = int(number.max(initial=-1)) + 1, len(SIDES)
    entry, (passage, side) = (number, rows["side"]), np.indices(shape)
    table = {name: gathered(np.add, rows[name], entry, shape) for name in ("touching_s", *INTEGRALS)}
    table |= {"count": gathered(np.add, 1, entry, shape, 0), "share_pct": 100 * table["touching_s"] / turn}
    areas = gathered(np.bitwise_or, rows["areas"], entry, shape, 0)
    names = {bits: ",".join(str(area) for area in range(1, 11) if bits >> (area - 1) & 1) for bits in np.unique(areas)}
    table["areas"] = np.array([names[bits] for bits in areas.ravel()], dtype=object).reshape(shape)

    table["peak_n"] = gathered(np.fmax, rows["peak_n"], entry, shape)
    table["highest_s"] = _times_of_highest(rows, shape)
    rows = {name: column[lasting] for name, column in rows.items()}
    entry = rows["passage"], rows["side"]
    for reduce, ends in ((np.fmin, ("start_s", "phase_start")), (np.fmax, ("end_s", "phase_end"))):
        table |= {name: gathered(reduce, rows[name], entry, shape, NAN) for name in ends}
    table["peak_s"] = _times_of_highest(rows, shape)
    connector = gathered(np.maximum, connectors, (number,), shape[:1], 0)
    return table | {"passage": passage, "side": np.array(SIDES)[side], "connector": connector[passage]}


def _times_of_highest(rows: dict[str, np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
    """Return the (m, 3) times of the largest force of contacts by passage and side, s; NaN without contact."""
    times, entry = np.full(shape, NAN), (rows["passage"], rows["side"])
    highest = first_of_highest(rows["peak_n"], np.ravel_multi_index(entry, shape))
    times[entry[0][highest], entry[1][highest]] = rows["peak_s"][highest]
    return times


def sampled_shares(area: np.ndarray, rig: Rig) -> np.ndarray:
    """Return the (11,) time in each area, % of a sprocket turn per passage, from areas (s, p) by sample and pitch."""
    if not area.size:
        return np.full(11, NAN)
    return 100 * np.bincount(area.ravel(), minlength=11) / area.size * rig.chain.pitches / rig.sprocket.teeth
