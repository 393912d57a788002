"""Contacts of a revolution of the loop, stitched from the records of all connectors within a pitch passage.

What is taken from whole passages of a long record comes here from samples of a short one
(`measure.whole_loop.stitched_contacts`).
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.events import RESOLUTION, event_times, smoothed_maxima
from trackdyn.measure.whole_loop import stitched_contacts
from trackdyn.simulation.recording import Recording

PRINTED = (("left", 2, 0.17), ("right", 7, 1.07))  # area that the arc touches without a ring, time of its maximum (s)
NEAR = 0.15  # s around a printed time
EARLY = 0.35  # turns after the first contact of a passage


def summary(recording: Recording) -> tuple[dict, dict[str, float]]:
    """Columns of `meshing_summary` that claims are judged by, smooth forms of what jumps, and `event_times`.

    Smooth forms: ``left_outside_2_pct, right_outside_7_pct``: contact in other areas, each times its distance in areas,
    % of a turn; ``left_early_pct``: contact of the left arc in the first 0.35 turns of a passage, % of a turn;
    ``left_at_printed, right_at_printed``: largest force (mean over 0.01 s) near the printed time of the maximum without
    a ring, over the largest of the passage. Beside them ``area <event>``: areas of `smoothed_maxima`.
    """
    contacts = stitched_contacts(recording)
    values = {name: value for name, value in meshing_summary(contacts).items() if "_error" not in name}
    values |= {f"area {row.event}": int(row.area) for row in smoothed_maxima(contacts).itertuples()}
    turn = contacts.periods.turn * contacts.rate
    # a revolution of the connector a row, from the middle of its free way on
    samples, count = round(contacts.periods.loop * contacts.rate), values["passages"]
    begin = (len(contacts.time) - count * samples) // 2
    force, area = (
        array[begin : begin + count * samples].reshape(count, samples, *array.shape[1:])
        for array in (contacts.force, contacts.area)
    )
    touching = area[:, :, 0].any(axis=2) | (force[:, :, 1, 2] > 0)
    start = touching.argmax(axis=1)
    arcs = np.stack([np.roll(rows[:, 0], -k, axis=0) for rows, k in zip(force, start, strict=True)])
    values["left_early_pct"] = 100 * float((arcs[:, : round(EARLY * turn), 0] > 0).sum(axis=1).mean()) / turn
    smooth = uniform_filter1d(arcs, max(round(RESOLUTION * contacts.rate), 1), axis=1, mode="wrap")
    seconds = np.arange(samples) / contacts.rate
    for i, (side, printed, time) in enumerate(PRINTED):
        touched = area[:, :, 0, i]
        away = np.where(touched > 0, abs(touched - printed), 0)
        values[f"{side}_outside_{printed}_pct"] = 100 * float(away.sum(axis=1).mean()) / turn
        highest, near = smooth[..., i].max(axis=1), smooth[:, abs(seconds - time) < NEAR, i].max(axis=1)
        values[f"{side}_at_printed"] = float(np.mean(near / np.where(highest > 0, highest, np.inf)))
    return values, event_times(contacts)
