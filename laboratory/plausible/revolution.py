"""Contacts of a revolution of the loop, stitched from the records of all connectors within a pitch passage."""

from dataclasses import replace

import numpy as np
import pandas as pd

from trackdyn.measure.estimators import meshing_summary
from trackdyn.measure.events import like_peaks, mean_events
from trackdyn.measure.whole_loop import passage_edges, revolution_samples
from trackdyn.model.arrays import CONTACT_INTERVAL, SIDES
from trackdyn.simulation.recording import Recording

EARLY = 0.35  # turns after the first contact of a passage
PRINTED_AREAS = (2, 7)  # of the left and the right arc without a ring


def summary(recording: Recording, detailed: bool = True) -> dict:
    """Return the columns of `meshing_summary` that claims are judged by; ``detailed``, events and forms without jumps.

    ``left_outside_pct, right_outside_pct``: contact in other areas than the printed ones, each times its distance in
    areas, % of a turn; ``left_early_pct``: contact of the left arc in the first 0.35 turns of a passage, % of a turn.
    """
    contacts = stitched_contacts(recording)
    values = {name: value for name, value in meshing_summary(contacts).items() if "_error" not in name}
    if not detailed:
        return values
    for row in pd.concat([mean_events(contacts), like_peaks(contacts)]).itertuples():
        values |= {f"event {row.event}": row.median_s, f"scatter {row.event}": row.sd_s}
        if row.area == row.area:
            values[f"area {row.event}"] = int(row.area)
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
    left = np.stack([np.roll(rows, -k) for rows, k in zip(force[:, :, 0, 0], start, strict=True)])
    values["left_early_pct"] = 100 * float((left[:, : round(EARLY * turn)] > 0).sum(axis=1).mean()) / turn
    for i, (side, printed) in enumerate(zip(SIDES, PRINTED_AREAS, strict=False)):
        touched = area[:, :, 0, i]
        away = np.where(touched > 0, abs(touched - printed), 0)
        values[f"{side}_outside_pct"] = 100 * float(away.sum(axis=1).mean()) / turn
    return values


def stitched_contacts(recording: Recording) -> Recording:
    """Return the contacts of a connector and the link ahead over a revolution for each whole passage of a record.

    Every pitch is recorded. Each revolution begins in the middle of the connector's free way; half a one lies before
    and after them. Other arrays than those of contacts are empty. Times and peaks of the log are those of samples.
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
    """Return the index of the middle of the longest pause of a circular series; 0 without a contact."""
    if not len(at := np.flatnonzero(touching)):
        return 0
    pauses = np.diff(np.r_[at[-1] - len(touching), at])
    longest = pauses.argmax()
    return int(at[longest] - pauses[longest] // 2) % len(touching)


def _sampled_intervals(force: np.ndarray, area: np.ndarray, pitch_and_side: tuple[int, int], rate: float) -> np.ndarray:
    """Return (k,) intervals (`model.arrays.CONTACT_INTERVAL`) of a pitch and side from samples of force and area."""
    rows = []
    for begin, end in np.flatnonzero(np.diff(np.r_[0, force > 0, 0])).reshape(-1, 2):
        of = force[begin:end]
        bits = np.bitwise_or.reduce(1 << (area[begin:end].astype(int) - 1)) if pitch_and_side[1] < 2 else 0
        peak = of.max(), (begin + of.argmax() + 0.5) / rate
        rows.append((*pitch_and_side, 0, bits, begin / rate, end / rate, *peak, of.sum() / rate, of @ of / rate))
    return np.array(rows, CONTACT_INTERVAL)
