"""How far the row of a rig is from the paper's sentences: what a search makes small."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import PlausibleConfig
from laboratory.plausible.verdicts import evidence
from replication.paper.claims import JUDGED, SHOWN, Claim, Value, judge
from trackdyn.measure.contacts import LEAST_SHARE
from trackdyn.rig.rig import Rig

# Smooth forms (`revolution.summary`) of statements whose own measure is text or jumps: with a ring or without, column,
# value that is wanted, tolerance
FORMS: dict[str, tuple[tuple[bool, str, float, float], ...]] = {
    "C15": ((False, "left_outside_2_pct", 0.0, LEAST_SHARE), (False, "right_outside_7_pct", 0.0, LEAST_SHARE)),
    "C16b": ((False, "left_at_printed", 1.0, 0.1),),
    "C16c": ((False, "right_at_printed", 1.0, 0.1),),
    "C17a": ((True, "left_early_pct", 0.0, 0.5),),
    "C18": ((True, "left_outside_2_pct", 0.0, LEAST_SHARE), (True, "right_share_pct", 0.0, 0.5)),
}
BESIDE = ("C17a",)  # judged by its own distance, too
TREND = 0.05  # a trend that falls by so much more than it may is a tolerance further off
MISSING = 6.0  # tolerances, for a number that does not exist
# Half of a sentence's cost grows with its worst statement between these distances, so that a rig on the edge of a
# verdict costs more than one that holds it; the other half is the mean of its statements, and saturates beyond `FAR`.
SURE, LOST, FAR = 0.7, 1.3, 2.0


def statement_distances(
    config: PlausibleConfig, row_scenes: list[list], values: Mapping[str, dict], rig: Rig, claims: Sequence[Claim]
) -> list[tuple[Claim, float]]:
    """Largest distance (tolerances) of each of the ``claims`` from the paper's words; one is shown up to 1.

    ``values`` is the row of ``rig``, by the names of ``row_scenes`` (`draws.scenes`).
    """
    row = evidence(config, row_scenes, values, rig)
    distances = []
    for claim in claims:
        judgement = judge(claim, row)
        if judgement.verdict not in JUDGED:
            distances.append((claim, MISSING))
            continue
        sizes = [_form(config, values, *form) for form in FORMS.get(claim.name, ())]
        if claim.name not in FORMS or claim.name in BESIDE:
            sizes += _sizes(claim, judgement.values)
        sizes = np.abs(np.nan_to_num(sizes, nan=MISSING, posinf=MISSING, neginf=MISSING))
        largest = float(sizes.max(initial=0.0))
        if claim.name in FORMS and judgement.verdict != SHOWN:  # the smooth form may be small all the same
            largest = max(largest, 1.0)
        distances.append((claim, largest))
    return distances


def _form(
    config: PlausibleConfig, values: Mapping[str, dict], ring: bool, column: str, wanted: float, tolerance: float
) -> float:
    value = values[scene_name(config.speed_rpm, config.ring_radius_m if ring else None)][column]
    return float("nan") if value is None else (value - wanted) / tolerance


def _sizes(claim: Claim, values: Sequence[Value]) -> list[float]:
    if claim.rule != "rising":
        sizes = [value.distance for value in values]
        return [min(sizes)] if claim.any_reading and sizes else sizes
    ratios = [after.value / before.value for before, after in pairwise(values) if before.value]
    return [max(0.0, 1 + (1 - claim.within - ratio) / TREND) for ratio in ratios]


def by_sentence(distances: Iterable[tuple[Claim, float]]) -> dict[int, list[float]]:
    """Distances of the statements of each sentence."""
    sentences: dict[int, list[float]] = {}
    for claim, size in distances:
        if claim.sentence is not None:
            sentences.setdefault(claim.sentence, []).append(size)
    return sentences


def cost(distances: Iterable[tuple[Claim, float]]) -> float:
    """Sum over sentences: 0 for one that is shown with a margin, 1 for one that is far away."""
    total = 0.0
    for sizes in by_sentence(distances).values():
        worst = np.clip((max(sizes) - SURE) / (LOST - SURE), 0, 1)
        total += 0.5 * worst + 0.5 * np.mean([size**2 / (size**2 + FAR**2) for size in sizes])
    return float(total)
