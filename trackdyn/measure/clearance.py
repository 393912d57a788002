"""How far an arc that never touches its groove stays away from it: what a contact that does not occur lacks."""

import numpy as np

from trackdyn.errors import InputError
from trackdyn.model.constants import Tooth
from trackdyn.parameters.layout import body_lengths
from trackdyn.scene.build import build_shoes
from trackdyn.scene.scene import Scene
from trackdyn.simulation.recording import Recording

SIDES = ("left", "right")


def groove_gap(tooth: Tooth, x, y) -> np.ndarray:
    """Distance of arcs, centred at (x, y) of the groove frame, from the contour of their groove, m; negative within it.

    Least over the annular sectors that a centre lies in the angle of; infinite where it lies in none.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    least = np.full(x.shape, np.inf)
    for j in range(len(tooth.radius)):
        ex, ey = x - tooth.centre_x[j], y - tooth.centre_y[j]
        d = np.hypot(ex, ey)
        inside = ex * tooth.direction_x[j] + ey * tooth.direction_y[j] >= tooth.cos_half_angle[j] * d
        r, rc = tooth.radius[j], tooth.arc_radius
        gap = d - r - rc if tooth.convex[j] else r - rc - d
        least = np.where(inside, np.minimum(least, gap), least)
    return least


def arc_gaps(recording: Recording, scene: Scene) -> dict[str, float]:
    """Least distance of the left and the right arcs from their grooves over the record, from its configurations.

    ``left_gap_m, right_gap_m``: median over the connectors, 0 for one that touches; infinite if no arc comes near a
    groove. Raises `InputError`: the recording holds no configurations.
    """
    if not len(recording.frame):
        raise InputError("the recording holds no configurations: simulate with a frame interval above 0")
    rig, tooth = scene.rig, scene.model.tooth
    angles, turned = recording.frame[:, 2:-1], recording.frame[:, -1]
    along = np.cumsum(body_lengths(rig) * np.exp(1j * angles), axis=1)
    pins = (recording.frame[:, 0] + 1j * recording.frame[:, 1])[:, None] + np.insert(along, 0, 0.0, axis=1)[:, :-1]
    shoes = build_shoes(rig)
    at = pins[:, shoes.arc_body] + shoes.arc_x * np.exp(1j * angles[:, shoes.arc_body])
    at = (at - complex(rig.sprocket.x, rig.sprocket.y)) * np.exp(-1j * turned)[:, None]
    near = np.abs(at) <= tooth.addendum + tooth.arc_radius
    groove = np.floor(tooth.teeth * (np.angle(at) % (2 * np.pi)) / (2 * np.pi)).astype(int) % tooth.teeth
    at = at * (tooth.groove_cos - 1j * tooth.groove_sin)[groove]
    gap = np.where(near, groove_gap(tooth, at.real, at.imag), np.inf)
    found = {}
    for k, side in enumerate(SIDES):
        least = gap[:, k::2].min(axis=0)
        least = least[np.isfinite(least)]
        found[f"{side}_gap_m"] = float(np.median(np.maximum(least, 0.0))) if len(least) else float("inf")
    return found
