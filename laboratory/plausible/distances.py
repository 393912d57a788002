"""Residuals of a rig: distances of its row from the printed numbers and from the sentences of a search.

A residual of size 1 is at the bound of its claim (config/claims.yaml). Beyond it grows by the inverse hyperbolic sine,
so that a number that is far off still pulls, and pulls no other one away. Sentences 5, 8, 16 and 20 are not asked for.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from laboratory.plausible.rows import Values, scene_name
from laboratory.plausible.settings import PlausibleConfig
from trackdyn_replication.paper.measures import MAXIMUM

MISSING = 10.0  # for a number that does not exist
# printed values without a ring and with it (config/claims.yaml)
SHARES = {False: {"left": 45.1, "right": 44.4}, True: {"ring": 49.2, "left": 8.9}}
TIMES = {False: {"right gone": 1.29, "out": 1.31}, True: {"left touches": 1.25, "ring left": 1.43, "out": 1.51}}
MAXIMA = {False: {"left": 0.17, "right": 1.07}, True: {"ring": 0.22, "left": 1.42}}
POINTS, SECONDS = 2.0, 0.065  # tolerances (% of a turn, s)
OTHER_AREAS = 0.1  # % of a turn
FREE = 0.5  # % of a turn of the right arc: none
THRESHOLD, STEADY, NEAR_TEN = 0.305, 0.307, 10.0  # m, m, % of a turn
SHORTER, LESS = 0.85, 1.0  # of the duration and the force of the left arc, and of its SD, without a ring
FALL, GROWTH = 0.99, 1.15  # of the acceleration from speed to speed, and in all
PLATEAU, SENTENCE = 0.1, 0.5  # weights, that of a printed number 1


def bounded(difference: float, tolerance: float) -> float:
    """Return a residual from a difference and its tolerance."""
    return float(np.arcsinh(difference / tolerance) / np.arcsinh(1.0))


def at_most(value: float, bound: float, unit: float) -> float:
    """Return a residual of a bound on one side: 1 at it, 0 from a ``unit`` below it on."""
    return max(0.0, bounded(value - bound + unit, unit))


def residuals(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """Return residuals of a start by name: a fixed set for the scenes of a search."""
    bare, ringed = (values[scene_name(config.speed_rpm, ring)] for ring in (None, config.ring_radius_m))
    residual: dict[str, float] = {}
    for case, scene, ring in (("no ring", bare, False), ("ring", ringed, True)):
        for side, share in SHARES[ring].items():
            residual[f"{case}: {side} share"] = bounded(scene[f"{side}_share_pct"] - share, POINTS)
        times = TIMES[ring] | {f"{side} {MAXIMUM}": at for side, at in MAXIMA[ring].items()}
        for event, at in times.items():
            time = scene.get(f"event {event}")
            residual[f"{case}: {event}"] = MISSING if time is None else bounded(time - at, SECONDS)
        residual[f"{case}: left areas"] = bounded(scene["left_outside_pct"], OTHER_AREAS)
    residual["no ring: right areas"] = bounded(bare["right_outside_pct"], OTHER_AREAS)
    residual["ring: left early"] = bounded(ringed["left_early_pct"], OTHER_AREAS)
    first = [bare.get(f"event first {side}") for side in ("left", "right")]
    residual["no ring: at once"] = MISSING if None in first else bounded(first[0] - first[1], SECONDS)
    for column, most in (("left_share_pct", SHORTER), ("left_rms_contact_n", SHORTER), ("left_sd_n", LESS)):
        residual[f"sentence: {column}"] = at_most(ringed[column] / max(bare[column], 1.0), most, 0.1)
    return residual | _by_radius(config, values) | _by_speed(config, values)


def _by_radius(config: PlausibleConfig, values: Values) -> dict[str, float]:
    residual = {}
    for rpm, radii in config.search.radii_m.items():
        for smaller, larger in pairwise(filter(None, radii)):
            less, more = (values[scene_name(rpm, radius)]["ring_rms_n"] for radius in (smaller, larger))
            residual[f"sentence: ring {rpm:g} {larger:g}"] = at_most(-more / max(less, 1.0), -FALL, 0.05)
        for radius in filter(None, radii):
            scene = values[scene_name(rpm, radius)]
            if radius >= THRESHOLD:
                residual[f"right: {rpm:g} {radius:g}"] = at_most(scene["right_share_pct"], FREE, FREE)
            if radius >= STEADY:
                residual[f"plateau: {rpm:g} {radius:g}"] = bounded(scene["left_share_pct"] - NEAR_TEN, POINTS)
    return residual


def _by_speed(config: PlausibleConfig, values: Values) -> dict[str, float]:
    residual = {}
    for column in ("rms_g", "high_frequency_g"):
        sizes = {rpm: values[scene_name(rpm, config.ring_radius_m)][column] for rpm in config.search.radii_m}
        for (slow, before), (fast, after) in pairwise(sizes.items()):
            residual[f"sentence: {column} {slow:g} to {fast:g}"] = at_most(-after / max(before, 1e-3), -FALL, 0.02)
        first, *_, last = sizes.values()
        residual[f"sentence: {column} in all"] = at_most(-last / max(first, 1e-3), -GROWTH, 0.05)
    return residual


def weights(names: Mapping[str, float]) -> np.ndarray:
    """Return the weights of residuals by their names; a number weighs most, since rigs are compared by them first."""
    special = {"plateau": PLATEAU, "sentence": SENTENCE}
    return np.array([special.get(name.partition(":")[0], 1.0) for name in names])
