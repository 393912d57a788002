"""The log of contacts in order: what the record cut left out, chatter merged, and which passage of a connector each
belongs to.
"""

import numpy as np

from trackdyn.model.record import SPELL
from trackdyn.simulation.recording import Recording

SIDES = ("left", "right", "ring")
# Turns of the sprocket: 0.01 s, to which the paper prints times, of the 2.906 s that a turn takes at 115 rpm. A shorter
# gap does not separate two contacts; a shorter contact begins, ends and peaks nothing.
SHORT = 0.01 / 2.906
# Turns of the sprocket. No contact of a passage, and no pause in it, lasts longer than this: the chain
# leaves the sprocket after about half a turn. Passages nearer to an end of the record may be incomplete.
LONGEST_CONTACT = 2 / 3
# turns of the sprocket from the first to the last contact of a passage
PASSAGE = 0.6
# turns of the sprocket from the start of a visit of an arc to the next one at least
VISIT = 0.7
NAN = float("nan")
INTEGRALS = ("impulse_ns", "square_n2s")


def contacts(recording: Recording, gap: float | None = None) -> dict[str, np.ndarray]:
    """Columns of `spells` by connector and start; pitches from 0, sides by number, areas as bits.

    ``start, end, touching`` are ``start_s, end_s, touching_s`` at the mean speed of the record
    (`Recording.steady_time`); ``lasting`` tells which contacts are not short (``SHORT``), the default ``gap`` (s).
    """
    short = SHORT * recording.periods.turn
    rows = _merged(recording, short if gap is None else gap)
    rows["lasting"] = rows["end"] - rows["start"] >= short
    ring, pitches = SIDES.index("ring"), recording.scene.rig.chain.pitches
    rows["connector"] = np.where(rows["side"] == ring, (rows["pitch"] - 1) % pitches, rows["pitch"])
    order = np.lexsort((rows["side"], rows["start_s"], rows["connector"]))
    rows = {name: column[order] for name, column in rows.items()}
    number, first = _number_passages(rows, recording)
    on_ring = (rows["side"] == ring) & (number >= 0)
    size = number.max(initial=-1) + 2  # the last one is nobody's: that of the number -1
    begin = extreme(np.fmin, rows["start"][on_ring], number[on_ring], size)[number]
    length = extreme(np.fmax, rows["end"][on_ring], number[on_ring], size)[number] - begin
    for end in ("start", "end"):
        rows[f"phase_{end}"] = (rows[end] - first) / recording.periods.turn
        rows[f"ring_phase_{end}"] = (rows[end] - begin) / length
    return rows | {"passage": number}


def extreme(which: np.ufunc, values: np.ndarray, index: np.ndarray, size: int) -> np.ndarray:
    """Smallest (``np.fmin``) or largest (``np.fmax``) of the values of every index, NaN where there is none."""
    extremes = np.full(size, NAN)
    which.at(extremes, index, values)
    return extremes


def first_of_highest(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Index of the largest value of every group, the first one of equals."""
    order = np.lexsort((-values, group))
    return order[np.flatnonzero(np.diff(group[order], prepend=-1))]


def _merged(recording: Recording, gap: float) -> dict[str, np.ndarray]:
    """Columns of the log without what the record cut, chatter merged, times since its beginning."""
    # a contact that lasted already is logged from the first step of the record on
    begin = recording.begin + 1.5 * recording.scene.step
    begun = recording.spells[recording.spells["start_s"] > begin]
    order = np.lexsort([begun[name] for name in ("start_s", "groove", "side", "pitch")])
    log = {name: begun[name][order] for name in SPELL.names or ()}
    integers = ("pitch", "side", "groove", "areas")
    log |= {name: log[name].astype(int) for name in integers}
    begins = np.ones(len(order), bool)
    same = np.all([np.diff(log[name]) == 0 for name in integers[:3]], axis=0)
    begins[1:] = ~(same & (log["start_s"][1:] - log["end_s"][:-1] < gap))
    first = np.flatnonzero(begins)
    rows = {name: log[name][first] for name in ("pitch", "side", "groove", "start_s")}
    rows["areas"] = np.bitwise_or.reduceat(log["areas"], first)
    rows["end_s"] = log["end_s"][np.roll(begins, -1)]
    log["touching_s"] = log["end_s"] - log["start_s"]
    rows |= {name: np.add.reduceat(log[name], first) for name in ("touching_s", *INTEGRALS)}
    highest = first_of_highest(log["peak_n"], np.cumsum(begins))
    rows |= {name: log[name][highest] for name in ("peak_n", "peak_s")}
    for name in ("start_s", "end_s", "peak_s"):
        rows[name] = rows[name] - recording.begin
    rows |= {name: recording.steady_time(rows[f"{name}_s"]) for name in ("start", "end")}
    rows["touching"] = rows["touching_s"]
    if recording.turns is not None:
        begins_at, ends_at = (recording.steady_time(log[name] - recording.begin) for name in ("start_s", "end_s"))
        rows["touching"] = np.add.reduceat(ends_at - begins_at, first)
    return rows


def _number_passages(rows: dict[str, np.ndarray], recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Number of the complete passage (or -1) and its first lasting contact (or NaN) of every row.

    Rows are sorted by connector and start; times are those at the record's mean speed. A pause of half of what a
    connector runs free in a loop revolution parts two passages.
    """
    start, end, connector, period = rows["start"], rows["end"], rows["connector"], recording.periods
    if not len(start):
        return np.zeros(0, int), np.zeros(0)
    pause = 0.5 * (period.loop - 0.5 * period.turn)
    apart = connector * 2 * (end.max() + pause)  # so that the latest end so far is one of the same connector
    begins = np.ones(len(start), bool)
    begins[1:] = (start + apart)[1:] - np.maximum.accumulate(end + apart)[:-1] > pause
    group, index = np.cumsum(begins) - 1, np.flatnonzero(begins)
    first, last = np.minimum.reduceat(start, index), np.maximum.reduceat(end, index)
    margin = LONGEST_CONTACT * period.turn
    complete = np.flatnonzero((first >= margin) & (last <= recording.seconds - margin))
    number = np.full(len(index), -1)
    number[complete[np.argsort(first[complete], kind="stable")]] = np.arange(len(complete))
    began = extreme(np.fmin, start[lasting := rows["lasting"]], group[lasting], len(index))
    return number[group], np.where(number >= 0, began, NAN)[group]
