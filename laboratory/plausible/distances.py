"""How far the row of a rig is from the printed numbers and from the sentences: what a search makes small.

Each residual is signed and in units of a tolerance, so that differences show which way to go; none saturates, so that
what is far off still pulls. Printed numbers come first, then what the sentences ask beside them.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from laboratory.plausible.rows import Values, scene_name
from laboratory.plausible.settings import PlausibleConfig
from trackdyn_replication.paper.measures import MAXIMUM

MISSING = 6.0  # tolerances, for a number that does not exist
# without a ring and with it: what is printed (config/claims.yaml)
SHARES = {False: {"left": 45.1, "right": 44.4}, True: {"ring": 49.2, "left": 8.9}}
TIMES = {False: {"right gone": 1.29, "out": 1.31}, True: {"left touches": 1.25, "ring left": 1.43, "out": 1.51}}
MAXIMA = {False: {"left": 0.17, "right": 1.07}, True: {"ring": 0.22, "left": 1.42}}
POINTS, SECONDS = 1.3, 0.045  # two thirds of the tolerances, so that the end is not on their edge
OUTSIDE = 0.7  # % of a turn, in other areas
FREE = 0.4  # % of a turn of the right arc: none
TOUCHES = 1.2  # % of a turn that the right arc touches at the radius below the threshold
THRESHOLD, STEADY = 0.305, 0.307  # m
NEAR_TEN = 8.7, 11.3  # % of a turn
GROWTH = 1.17, 1.24  # of a force from the lowest speed to the highest: above practically none, and limited
FLAT = 0.12  # share by which the left arc's force may be off its mean


def outside(value: float, low: float, high: float, size: float) -> float:
    """Distance of a value from a range, in units of ``size``: 0 within it, negative below."""
    return (value - high) / size if value > high else (value - low) / size if value < low else 0.0


def residuals(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """Residuals of a start by name (``values`` by the name of the scene): a fixed set for the scenes of a search."""
    scenes = {
        ring: values[scene_name(config.speed_rpm, config.ring_radius_m if ring else None)] for ring in (False, True)
    }
    distances: dict[str, float] = {}
    for ring, scene in scenes.items():
        case = "ring" if ring else "no ring"
        for side, share in SHARES[ring].items():
            distances[f"{case}: {side} share"] = (scene[f"{side}_share_pct"] - share) / POINTS
        for event, at in TIMES[ring].items():
            distances[f"{case}: {event}"] = _late(scene, event, at)
        for side, at in MAXIMA[ring].items():
            distances[f"{case}: {side} maximum"] = _late(scene, f"{side} {MAXIMUM}", at)
        distances[f"{case}: left areas"] = scene["left_outside_pct"] / OUTSIDE
    bare, ringed = scenes[False], scenes[True]
    distances["no ring: right areas"] = bare["right_outside_pct"] / OUTSIDE
    first_left, first_right, gone, out = (
        bare.get(f"event {name}") for name in ("first left", "first right", "right gone", "out")
    )
    distances["no ring: at once"] = (
        MISSING if None in (first_left, first_right) else (first_left - first_right) / SECONDS
    )
    distances["no ring: outlasts"] = MISSING if None in (gone, out) else (out - gone - 0.02) / SECONDS
    distances["ring: left early"] = ringed["left_early_pct"] / FREE
    distances["ring: shorter force"] = outside(_ratio(ringed, bare, "left_rms_contact_n"), 0.0, 0.8, 0.1)
    distances["ring: varies less"] = outside(_ratio(ringed, bare, "left_sd_n"), 0.0, 0.95, 0.1)
    return distances | _by_radius(config, values) | _by_speed(config, values)


def _late(scene: Mapping, event: str, at: float) -> float:
    time = scene.get(f"event {event}")
    return MISSING if time is None else (time - at) / SECONDS


def _ratio(scene: Mapping, reference: Mapping, column: str) -> float:
    return scene[column] / max(reference[column], 1.0)


def _by_radius(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """What is printed or said of the ring study at every speed."""
    distances = {}
    for rpm, radii in _radii(config).items():
        study = {radius: values[scene_name(rpm, radius)] for radius in radii}
        forces = np.array([scene["left_rms_n"] for scene in study.values()])
        ring = [scene["ring_rms_n"] for scene in study.values()]
        steps = [after / max(before, 1.0) for before, after in pairwise(ring)]
        distances[f"{rpm:g}: ring grows"] = outside(min(steps), 1.01, 99.0, 0.04)
        for (radius, scene), force in zip(study.items(), forces, strict=True):
            name = f"{rpm:g} {radius:g}"
            distances[f"{name}: flat"] = outside(force / max(forces.mean(), 1.0) - 1, -FLAT, FLAT, FLAT)
            if radius >= THRESHOLD:
                distances[f"{name}: right"] = scene["right_share_pct"] / FREE
            elif radius >= THRESHOLD - 0.001:
                distances[f"{name}: right"] = outside(scene["right_share_pct"], TOUCHES, 99.0, 0.5)
            if radius >= STEADY:
                distances[f"{name}: left"] = outside(scene["left_share_pct"], *NEAR_TEN, 1.0)
    return distances


def _by_speed(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """What is said of the acceleration and of the forces as the speed grows."""
    distances, speeds = {}, list(_radii(config))
    for slow, fast in pairwise(speeds):
        before, after = (values[scene_name(rpm, config.ring_radius_m)] for rpm in (slow, fast))
        for column in ("rms_g", "high_frequency_g"):
            distances[f"{fast:g}: {column}"] = outside(after[column] / max(before[column], 1e-3), 1.008, 99.0, 0.012)
    first, last = speeds[0], speeds[-1]
    radii = [radius for radius in _radii(config)[first] if radius in _radii(config)[last]]
    for column in ("rms_n", "sd_n"):
        growth = {
            side: np.mean([
                _ratio(values[scene_name(last, radius)], values[scene_name(first, radius)], f"{side}_{column}")
                for radius in radii
            ])
            for side in ("left", "ring")
        }  # fmt: skip
        for side, ratio in growth.items():
            distances[f"{side} {column} grows"] = outside(float(ratio), *GROWTH, 0.05)
        distances[f"left {column} above all"] = outside(float(growth["left"] / growth["ring"]), 1.02, 99.0, 0.05)
    return distances


def _radii(config: PlausibleConfig) -> dict[float, Sequence[float]]:
    return {rpm: [radius for radius in radii if radius is not None] for rpm, radii in config.search.radii_m.items()}


def cost(distances: Mapping[str, float]) -> float:
    """Sum of the squares of arcsinh of residuals, which weighs a number far off by a logarithm."""
    return float(np.sum(np.arcsinh(list(distances.values())) ** 2))
