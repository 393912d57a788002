"""Contacts of a revolution of the loop, stitched from the records of all connectors within a pitch passage.

What `measure.meshing` takes from whole passages of a long record comes here from samples of a short one: the motion
repeats from pitch to pitch (`measure.whole_loop`), so that all connectors within one passage are one connector within a
revolution. Times are whole samples.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from trackdyn.measure.contact_log import SIDES, timing
from trackdyn.measure.meshing import AFTER_TOUCH, EVENTS_WITH_RING, EVENTS_WITHOUT_RING, LEAST_SHARE, RESOLUTION
from trackdyn.measure.whole_loop import passage_edges, places
from trackdyn.simulation.recording import Recording

MEAN = f"mean over {RESOLUTION:g} s"


def revolutions(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Force (r, k, 3), N, and area (r, k, 2) of a connector over r revolutions, one from each whole passage.

    Each begins with the first contact of any kind, on the sprocket or of the link ahead with the ring.
    """
    links = len(recording.pitches)
    ring = SIDES.index("ring")
    forces, areas = [], []
    for first in passage_edges(recording)[:-1]:
        _, rows, columns, _ = places(recording, first, links)
        force = recording.force[rows, columns].copy()
        force[:, ring] = recording.force[rows, (columns + 1) % links, ring]  # of the link ahead
        begin = _after_longest_pause(force.max(axis=1) > 0)
        forces.append(np.roll(force, -begin, axis=0))
        areas.append(np.roll(recording.area[rows, columns], -begin, axis=0))
    return np.array(forces), np.array(areas)


def _after_longest_pause(touching: np.ndarray) -> int:
    """Index at which the longest pause of a circular series ends; 0 without a contact."""
    at = np.flatnonzero(touching)
    if not len(at):
        return 0
    pauses = np.diff(np.r_[at[-1] - len(touching), at])
    return int(at[pauses.argmax()])


def summary(recording: Recording) -> tuple[dict, dict[str, float]]:
    """Columns of `meshing_summary` and `first_areas` that claims are judged by, and `event_times`.

    To the columns come ``left_outside_2_pct, right_outside_7_pct``: contact in other areas, each times its distance in
    areas, % of a turn, and ``left_late_2_pct, right_late_7_pct``: the same, of contact before the arc first touches in
    that area; NaN without a contact.
    """
    force, area = revolutions(recording)
    turn = timing(recording).turn * recording.rate  # samples
    touching = force > 0
    found: dict = {"passages": len(force)}
    first, last = _ends(touching)
    for i, side in enumerate(SIDES):
        square = (force[..., i] ** 2).mean()
        contact = touching[..., i].sum()
        found |= {
            f"{side}_share_pct": 100 * contact / len(force) / turn,
            f"{side}_rms_n": square**0.5,
            f"{side}_sd_n": max(square - force[..., i].mean() ** 2, 0.0) ** 0.5,
            f"{side}_rms_contact_n": (square * force[..., i].size / contact) ** 0.5 if contact else 0.0,
            f"{side}_phase_start": _mean(first[:, i]) / turn,
            f"{side}_phase_end": _mean(last[:, i] + 1) / turn,
        }
    for i, (side, printed) in enumerate((("left", 2), ("right", 7))):
        samples = np.bincount(area[..., i].ravel(), minlength=11) / len(area) / turn * 100
        away = np.where(area[..., i] > 0, abs(area[..., i] - printed), 0)
        before = np.logical_and.accumulate(area[..., i] != printed, axis=1)
        late = (away * before).sum(axis=1)[np.isfinite(first[:, i])]
        begins = [int(one[int(at), i]) for one, at in zip(area, first[:, i], strict=True) if np.isfinite(at)]
        found |= {
            f"{side}_areas": ",".join(str(k) for k in range(1, 11) if samples[k] >= LEAST_SHARE) or "none",
            f"{side}_first_area": max(set(begins), key=begins.count, default=0),
            f"{side}_outside_{printed}_pct": 100 * float(away.sum(axis=1).mean()) / turn,
            f"{side}_late_{printed}_pct": 100 * _mean(late) / turn,
        }
    return found, _events(force, first, last, recording)


def _ends(touching: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(r, 3) first and last sample with contact; NaN without."""
    some = touching.any(axis=1)
    first = np.where(some, touching.argmax(axis=1), np.nan)
    last = np.where(some, touching.shape[1] - 1 - touching[:, ::-1].argmax(axis=1), np.nan)
    return first, last


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _events(force, first, last, recording: Recording) -> dict[str, float]:
    """Mean times after the first contact, s."""
    without = recording.meta["scene"]["ring_radius"] is None
    ends = {"start_s": first, "end_s": last + 1}
    found = {}
    for event, (side, column) in (EVENTS_WITHOUT_RING if without else EVENTS_WITH_RING).items():
        if column in ends:
            of = [0, 1] if side == "arcs" else [SIDES.index(side)]
            found[event] = _mean(np.fmax.reduce(ends[column][:, of], axis=1)) / recording.rate
    window = max(round(RESOLUTION * recording.rate), 1)
    smooth = uniform_filter1d(force, window, axis=1, mode="wrap")
    for i, side in enumerate(SIDES):
        highest: dict[str, list[float]] = {MEAN: [], AFTER_TOUCH: []}
        for one, flat, touch in zip(force[..., i], smooth[..., i], first[:, i], strict=True):
            if np.isfinite(touch):
                after = int(touch) + window
                highest[MEAN].append(float(flat[: len(flat) // 2 + after].argmax()))
                highest[AFTER_TOUCH].append(float(after + one[after:].argmax()))
        found |= {f"{side} maximum, {name}": _mean(np.array(at)) / recording.rate for name, at in highest.items()}
    return found
