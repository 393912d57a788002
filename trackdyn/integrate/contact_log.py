"""Contact log of a run: one row for every uninterrupted contact of an arc or a link."""

from trackdyn.jit import kernel
from trackdyn.model.arrays import ContactLog, State, Work
from trackdyn.model.constants import SPROCKET


@kernel
def log_contacts(contact_log: ContactLog, state: State, work: Work, time, step):
    """Open, extend or close the interval of every contact of the sprocket after a step.

    The force at ``time`` acts for one ``step`` (s). An interval beyond the last row is only counted. Arcs and links
    away from the sprocket are checked when the lists of `contact.neighbours` are new: they may have left in contact.
    """
    candidates = work.candidates
    if candidates.count[2]:
        for arc in range(work.tooth_force.shape[0]):
            _log(contact_log, work, 3 * (arc // 2) + arc % 2, time, step)
        for pitch in range(work.wheel_force.shape[0]):
            _log(contact_log, work, 3 * pitch + 2, time, step)
    else:
        for item in range(candidates.count[0]):
            _log(contact_log, work, 3 * (candidates.arc[item] // 2) + candidates.arc[item] % 2, time, step)
        for item in range(candidates.count[1]):
            if candidates.link[item, 1] == SPROCKET:
                _log(contact_log, work, 3 * candidates.link[item, 0] + 2, time, step)


@kernel
def _log(contact_log: ContactLog, work: Work, i, time, step):
    """Update interval ``3 pitch + side`` (0 left arc, 1 right arc, 2 ring) at a time after a step, s."""
    pitch, side = i // 3, i % 3
    entry, last = contact_log.open[i], contact_log.last[i]
    force = work.wheel_force[pitch, SPROCKET] if side == 2 else work.tooth_force[2 * pitch + side]
    begun = entry["end_s"] > 0.0
    if force <= 0.0 and not begun:
        return
    groove = 0 if side == 2 else work.tooth_groove[2 * pitch + side]
    if begun and (force <= 0.0 or groove != entry["groove"]):
        k = contact_log.count[0]
        if k < contact_log.rows.shape[0]:
            contact_log.rows[k] = entry
        contact_log.count[0], entry["end_s"], begun = k + 1, 0.0, False
    if force <= 0.0:
        return
    if not begun:
        entry["pitch"], entry["side"], entry["groove"], entry["start_s"] = pitch, side, groove, time
        entry["areas"] = entry["peak_n"] = entry["impulse_ns"] = entry["square_n2s"] = last[0] = last[1] = 0.0
    entry["end_s"] = time + step
    if force > entry["peak_n"]:
        entry["peak_n"], entry["peak_s"] = force, time
    # the vertex of the parabola through the last three forces, if the middle one is the largest: the largest of nine
    # steps a period misses 2 % of a sine's peak on average. Where a neighbour is less than half of the middle one, the
    # steps do not resolve the peak, and the largest force remains.
    before, middle = last[1], last[0]
    if middle > before and middle >= force and before >= 0.5 * middle and force >= 0.5 * middle:
        bend = before - 2.0 * middle + force
        top = middle - (force - before) ** 2 / (8.0 * bend)
        if top > entry["peak_n"]:
            entry["peak_n"], entry["peak_s"] = top, time - step + 0.5 * step * (before - force) / bend
    last[0], last[1] = force, last[0]
    entry["impulse_ns"] += force * step
    entry["square_n2s"] += force * force * step
    if side < 2:
        entry["areas"] = int(entry["areas"]) | (1 << (work.tooth_area[2 * pitch + side] - 1))
