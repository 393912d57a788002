"""Contacts of a revolution of the loop, stitched from the records of all connectors within a pitch passage.

What is taken from whole passages of a long record comes here from samples of a short one (`stitched_contacts`).
"""

from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.events import RESOLUTION, event_times, smoothed_maxima
from trackdyn.measure.whole_loop import passage_edges, revolution_samples
from trackdyn.model.arrays import CONTACT_INTERVAL
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


def stitched_contacts(recording: Recording) -> Recording:
    """Contacts of one connector and the link ahead over a revolution of the loop for each whole passage of a record.

    Every pitch is recorded. The revolutions stand one after another, each from the middle of the connector's free way
    on, with half a one before and after them. Other arrays than those of contacts are empty. The log is made from
    samples: its times are whole ones, its peaks the largest sample.
    """
    links, rate, revolutions = len(recording.pitches), recording.rate, []
    for first in passage_edges(recording)[:-1]:
        rows, columns = revolution_samples(recording, first, links)
        pair = np.column_stack([columns, (columns + 1) % links])
        touching = (recording.force[rows[:, None], pair] > 0)[:, [0, 0, 1], [0, 1, 2]].any(axis=1)
        revolutions.append((np.roll(rows, -(shift := _free_way(touching))), np.roll(pair, -shift, axis=0)))
    half = len(revolutions[0][0]) // 2
    (rows, pair), (last_rows, last_pair) = revolutions[0], revolutions[-1]
    at = np.concatenate([last_rows[-half:], *(rows for rows, _ in revolutions), rows[:half]])
    pairs = np.concatenate([last_pair[-half:], *(pair for _, pair in revolutions), pair[:half]])
    force, area = recording.force[at[:, None], pairs], recording.area[at[:, None], pairs]
    empty = {name: getattr(recording, name)[:0] for name in ("raw", "mean", "gap", "cut", "link_position", "energy")}
    return replace(
        recording,
        time=np.arange(1, len(at) + 1) / rate,
        wheel_rate=np.full((len(at), 1), recording.scene.sprocket_rate),
        force=force,
        area=area,
        groove=np.zeros_like(area),
        pitches=np.array([1, 2]),
        contact_log=np.concatenate([
            _sampled_intervals(force[:, pitch, side], area[:, pitch, min(side, 1)], (pitch, side), rate)
            for pitch, side in ((0, 0), (0, 1), (1, 2))
        ]),
        begin=0.0,
        **empty,
    )  # fmt: skip


def _free_way(touching: np.ndarray) -> int:
    """Index of the middle of the longest pause of a circular series; 0 without a contact."""
    at = np.flatnonzero(touching)
    if not len(at):
        return 0
    pauses = np.diff(np.r_[at[-1] - len(touching), at])
    longest = pauses.argmax()
    return int(at[longest] - pauses[longest] // 2) % len(touching)


def _sampled_intervals(force: np.ndarray, area: np.ndarray, who: tuple[int, int], rate: float) -> np.ndarray:
    """(k,) intervals (`model.arrays.CONTACT_INTERVAL`) of a pitch and side from samples of its force and area."""
    edges = np.flatnonzero(np.diff(np.r_[0, force > 0, 0]))
    begins, ends = edges[::2], edges[1::2]
    rows = []
    for begin, end in zip(begins, ends, strict=True):
        of = force[begin:end]
        bits = np.bitwise_or.reduce(1 << (area[begin:end].astype(int) - 1)) if who[1] < 2 else 0
        peak = of.max(), (begin + of.argmax() + 0.5) / rate
        rows.append((*who, 0, bits, begin / rate, end / rate, *peak, of.sum() / rate, of @ of / rate))
    return np.array(rows, CONTACT_INTERVAL)
