"""How far the row of a rig is from the printed numbers and from the sentences: what a search makes small.

Each residual is signed, so that differences show which way to go; none saturates, so that a number that is far off
still pulls. Within a margin of its tolerance a number pulls little, so that a step that helps another keeps it there,
and beyond it strongly: printed numbers weigh most, since rigs are compared by them first. A sentence that is judged at
many radii shares its weight among these.
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
OUTLASTS = 0.01, 0.03  # s
POINTS, SECONDS = 2.0, 0.065  # tolerances (% of a turn, s)
WITHIN, MARGIN, SIZE = 0.6, 0.85, 1 / 6  # weight of a number within a margin (tolerances), unit of what is beyond it
OTHER_AREAS = 0.05, 0.5  # % of a turn in other areas that is none, and the unit of the residual beyond
FREE = 0.4  # % of a turn of the right arc: none
TOUCHES = 1.2  # % of a turn that the right arc touches at the radius below the threshold
THRESHOLD, STEADY = 0.305, 0.307  # m
NEAR_TEN = 8.3, 11.7  # % of a turn
GROWTH = 1.17, 1.24  # of a force from the lowest speed to the highest: above practically none, and limited
FLAT = 0.14  # share by which the left arc's force may be off its mean
BY_RADIUS, BY_SPEED, OF_FORCES = (
    0.4,
    0.7,
    0.3,
)  # weights: of one of many radii; of accelerations and forces by the speed


def outside(value: float, low: float, high: float, size: float) -> float:
    """Distance of a value from a range, in units of ``size``: 0 within it, negative below."""
    return (value - high) / size if value > high else (value - low) / size if value < low else 0.0


def _off(value: float, printed: float, tolerance: float) -> float:
    """Residual of a printed number: steep beyond the margin of its tolerance."""
    difference = (value - printed) / tolerance
    return WITHIN * difference + outside(difference, -MARGIN, MARGIN, SIZE)


def residuals(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """Residuals of a start by name (``values`` by the name of the scene): a fixed set for the scenes of a search."""
    scenes = {
        ring: values[scene_name(config.speed_rpm, config.ring_radius_m if ring else None)] for ring in (False, True)
    }
    distances: dict[str, float] = {}
    for ring, scene in scenes.items():
        case = "ring" if ring else "no ring"
        for side, share in SHARES[ring].items():
            distances[f"{case}: {side} share"] = _off(scene[f"{side}_share_pct"], share, POINTS)
        for event, at in TIMES[ring].items():
            distances[f"{case}: {event}"] = _late(scene, event, at)
        for side, at in MAXIMA[ring].items():
            distances[f"{case}: {side} maximum"] = _late(scene, f"{side} {MAXIMUM}", at)
        distances[f"{case}: left areas"] = _in_other_areas(scene, "left")
    bare, ringed = scenes[False], scenes[True]
    distances["no ring: right areas"] = _in_other_areas(bare, "right")
    first_left, first_right, gone, out = (
        bare.get(f"event {name}") for name in ("first left", "first right", "right gone", "out")
    )
    distances["no ring: at once"] = (
        MISSING if None in (first_left, first_right) else _off(first_left - first_right, 0.0, SECONDS)
    )
    distances["no ring: outlasts"] = MISSING if None in (gone, out) else outside(out - gone, *OUTLASTS, 2 * SECONDS / 3)
    distances["ring: left early"] = ringed["left_early_pct"] / FREE
    distances["ring: shorter force"] = outside(_ratio(ringed, bare, "left_rms_contact_n"), 0.0, 0.8, 0.1)
    distances["ring: varies less"] = outside(_ratio(ringed, bare, "left_sd_n"), 0.0, 0.95, 0.1)
    return distances | _by_radius(config, values) | _by_speed(config, values)


def _late(scene: Mapping, event: str, at: float) -> float:
    time = scene.get(f"event {event}")
    return MISSING if time is None else _off(time, at, SECONDS)


def _in_other_areas(scene: Mapping, side: str) -> float:
    none, unit = OTHER_AREAS
    return outside(scene[f"{side}_outside_pct"], 0.0, none, unit)


def _ratio(scene: Mapping, reference: Mapping, column: str) -> float:
    return scene[column] / max(reference[column], 1.0)


def _by_radius(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """What is printed or said of the ring study at every speed."""
    distances = {}
    for rpm, radii in _radii(config).items():
        study = {radius: values[scene_name(rpm, radius)] for radius in radii}
        if len(radii) > 1:
            distances |= _study(rpm, study)
        for radius, scene in study.items():
            name, right = f"{rpm:g} {radius:g}", scene["right_share_pct"]
            if radius >= THRESHOLD:
                distances[f"{name}: right"] = outside(right, 0.0, FREE, FREE)
            elif radius >= THRESHOLD - 0.001:
                distances[f"{name}: right"] = BY_RADIUS * outside(right, TOUCHES, 99.0, 0.5)
            if radius >= STEADY:
                distances[f"{name}: left"] = BY_RADIUS * outside(scene["left_share_pct"], *NEAR_TEN, 0.8)
    return distances


def _study(rpm: float, study: Mapping[float, Mapping]) -> dict[str, float]:
    """Residuals of the forces over the radii of one speed."""
    forces = np.array([scene["left_rms_n"] for scene in study.values()])
    steps = [after["ring_rms_n"] / max(before["ring_rms_n"], 1.0) for before, after in pairwise(study.values())]
    deviations = forces / max(forces.mean(), 1.0) - 1
    flat = {
        f"{rpm:g} {radius:g}: flat": BY_RADIUS * outside(deviation, -FLAT, FLAT, 0.1)
        for radius, deviation in zip(study, deviations, strict=True)
    }
    return {f"{rpm:g}: ring grows": outside(min(steps), 1.01, 99.0, 0.04)} | flat


def _by_speed(config: PlausibleConfig, values: Values) -> dict[str, float]:
    """What is said of the acceleration and of the forces as the speed grows."""
    distances, speeds = {}, list(_radii(config))
    for slow, fast in pairwise(speeds):
        before, after = (values[scene_name(rpm, config.ring_radius_m)] for rpm in (slow, fast))
        for column in ("rms_g", "high_frequency_g"):
            distances[f"{fast:g}: {column}"] = BY_SPEED * outside(
                after[column] / max(before[column], 1e-3), 1.008, 99.0, 0.012
            )
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
            distances[f"{side} {column} grows"] = OF_FORCES * outside(float(ratio), *GROWTH, 0.05)
        distances[f"left {column} above all"] = OF_FORCES * outside(
            float(growth["left"] / growth["ring"]), 1.02, 99.0, 0.05
        )
    return distances


def _radii(config: PlausibleConfig) -> dict[float, Sequence[float]]:
    return {rpm: [radius for radius in radii if radius is not None] for rpm, radii in config.search.radii_m.items()}


def cost(distances: Mapping[str, float]) -> float:
    """Sum of the squares of arcsinh of residuals, which weighs a number far off by a logarithm."""
    return float(np.sum(np.arcsinh(list(distances.values())) ** 2))
