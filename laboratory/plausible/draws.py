"""Rigs drawn from the ranges of real parts, run in every scenario."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import qmc

from laboratory.plausible.rows import SOURCES, run_rig
from laboratory.plausible.settings import PlausibleConfig, Scenario
from trackdyn.errors import InputError, TrackdynError
from trackdyn.rig.layout import can_close
from trackdyn.rig.rig import Rig, load_rig, parameter_table
from trackdyn.sweeps.engine import REFUSED, check_completed, key_of, results, without_values

EQUAL_PITCH = "sprocket.equal_pitch_radius"


class DrawnRig(NamedTuple):
    """A point of the sequence in a scenario: values by name, and the rig or why there is none."""

    draw: int
    scenario: Scenario
    values: dict[str, float]
    rig: Rig | None
    reason: str


def drawn_rigs(config: PlausibleConfig) -> Iterator[DrawnRig]:
    """Every draw in every scenario, in the order of the sequence, so that fewer draws are the first of more."""
    unknowns = config.drawn_unknowns()
    sequence = qmc.Sobol(1 + len(unknowns), scramble=True, seed=config.seed)
    points = sequence.random_base2(int(np.ceil(np.log2(config.draws))))
    for draw, (pitch, *x) in enumerate(points[: config.draws]):
        for scenario in config.scenarios:
            low, high = config.equal_pitch_m[scenario.equal_pitch]
            fields = unknowns.changes(unknowns.values(x)) | config.ring[scenario.ring]
            fields[EQUAL_PITCH] = low + pitch * (high - low)
            values = {label: fields[label] for label in (EQUAL_PITCH, *unknowns.labels)}
            yield DrawnRig(draw, scenario, values, *built(unknowns.rig, fields))


def built(rig: Rig, fields: dict[str, float]) -> tuple[Rig | None, str]:
    """A rig with other values, or None and why there is none: its groove cannot be cut, its loop does not close."""
    try:
        changed = rig.changed(**fields)
        if can_close(changed):
            return changed, ""
        return None, "the loop does not close within the travel of the tensioner"
    except TrackdynError as error:
        return None, str(error)


def scenes(config: PlausibleConfig) -> list[list]:
    """Speed, ring radius and whether sensors are read, of every scene of a row."""
    rings = (None, *config.radii_m)
    return [[rpm, ring, ring == config.ring_radius_m] for rpm in config.speeds_rpm for ring in rings]


def tooth_scenes(config: PlausibleConfig) -> list[list]:
    """Scenes in which the tooth profiles are compared: every speed, without a ring and with the paper's, all sensed."""
    return [[rpm, ring, True] for rpm in config.speeds_rpm for ring in (None, config.ring_radius_m)]


def run_rigs(
    config: PlausibleConfig,
    rigs: Sequence[Rig | None],
    rig_scenes: list[list],
    jobs: int,
    store: Path | str,
    laws: Mapping[str, str] | None = None,
) -> list[dict]:
    """Rows (`rows.run_rig`) of rigs, in their order; a stored row is not computed again.

    ``laws`` are choices in place of those of the configuration. None in place of a rig gives a refused row.
    """
    content = {"scenes": rig_scenes, "fields": config.scene | dict(laws or {}), "row": config.row.model_dump()}
    tasks = [None if rig is None else content | {"rig": rig.model_dump()} for rig in rigs]
    keys = ["" if task is None else key_of(task, SOURCES) for task in tasks]
    requested = {key: task for key, task in zip(keys, tasks, strict=True) if task is not None}
    rows = results(run_rig, requested, jobs, store, "plausible tracks")
    check_completed(rows.values(), "the same command goes on from there")
    return [rows[key] if key else without_values("", REFUSED, "") for key in keys]


def neighbours(config: PlausibleConfig) -> list[Rig]:
    """The rig of ``near`` itself, then rigs with each of its fitted values moved at random by up to the share."""
    table = parameter_table(config.near.rig)
    fitted = table[(table["kind"] == "fitted") & pd.to_numeric(table["value"], errors="coerce").notna()]
    values = fitted.set_index("name")["value"].astype(float)
    rig = load_rig(config.near.rig)
    random = np.random.default_rng(config.seed)
    rigs = [rig]
    while len(rigs) <= config.near.rigs:
        factors = 1 + random.uniform(-config.near.share, config.near.share, len(values))
        moved, reason = built(rig, dict(values * factors))
        if moved is None:
            raise InputError(f"{config.near.rig}: a neighbour cannot be built ({reason}); take a smaller share")
        rigs.append(moved)
    return rigs
