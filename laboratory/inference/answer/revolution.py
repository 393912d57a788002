"""Contacts of a revolution of the loop, stitched from the records of all connectors within a pitch passage.

What is taken from whole passages of a long record comes here from samples of a short one
(`measure.whole_loop.stitched_contacts`).
"""

import numpy as np

from trackdyn.measure.contacts import event_times, first_areas, meshing_summary
from trackdyn.measure.whole_loop import stitched_contacts
from trackdyn.simulation.recording import Recording

PRINTED = (("left", 2), ("right", 7))  # areas that the arcs touch in the paper


def summary(recording: Recording) -> tuple[dict, dict[str, float]]:
    """Columns of `meshing_summary` and `first_areas` that claims are judged by, and `event_times`.

    To the columns come ``left_outside_2_pct, right_outside_7_pct``: contact in other areas, each times its distance in
    areas, % of a turn, and ``left_late_2_pct, right_late_7_pct``: the same, of contact before the arc first touches in
    that area; NaN without a contact.
    """
    contacts = stitched_contacts(recording)
    found = {name: value for name, value in meshing_summary(contacts).items() if "_error" not in name}
    found |= first_areas(contacts)
    turn = contacts.periods.turn * contacts.rate
    # a revolution of the connector a row, from the middle of its free way on
    samples = round(contacts.periods.loop * contacts.rate)
    count = found["passages"]
    begin = (len(contacts.time) - count * samples) // 2
    areas = contacts.area[begin : begin + count * samples, 0].reshape(count, samples, 2)
    for i, (side, printed) in enumerate(PRINTED):
        area = areas[..., i]
        away = np.where(area > 0, abs(area - printed), 0)
        before = np.logical_and.accumulate(area != printed, axis=1)
        late = (away * before).sum(axis=1)[area.any(axis=1)]
        found[f"{side}_outside_{printed}_pct"] = 100 * float(away.sum(axis=1).mean()) / turn
        found[f"{side}_late_{printed}_pct"] = 100 * float(late.mean()) / turn if len(late) else float("nan")
    return found, event_times(contacts)
