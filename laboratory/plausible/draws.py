"""Rigs drawn from the ranges of real parts, run in every scenario."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import qmc

from laboratory.inference.unknowns import Unknowns
from laboratory.plausible.rows import SOURCES, run_rig
from laboratory.plausible.settings import PlausibleConfig, Scenario
from trackdyn.errors import InputError, TrackdynError
from trackdyn.rig.layout import can_close
from trackdyn.rig.rig import Rig, load_rig, parameter_table
from trackdyn.sweeps.engine import check_completed, key_of, results

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
            yield DrawnRig(draw, scenario, _named(unknowns, fields), *_rig(unknowns.rig, fields))


def _named(unknowns: Unknowns, fields: dict[str, float]) -> dict[str, float]:
    return {EQUAL_PITCH: fields[EQUAL_PITCH]} | {label: fields[label] for label in unknowns.labels}


def _rig(rig: Rig, fields: dict[str, float]) -> tuple[Rig | None, str]:
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


class RigScenes(NamedTuple):
    """A rig, the laws of its scenes, and the scenes."""

    rig: Rig
    laws: dict
    scenes: list[list]


def run_rigs(config: PlausibleConfig, requested: Sequence[RigScenes], jobs: int, store: Path | str) -> list[dict]:
    """Rows (`rows.run_rig`) of rigs, in their order; a stored row is not computed again."""
    tasks: dict[str, dict] = {}
    keys = []
    for rig, laws, rig_scenes in requested:
        task = {"rig": rig.model_dump(), "scenes": rig_scenes, "fields": laws, "row": config.row.model_dump()}
        keys.append(key_of(task, SOURCES))
        tasks[keys[-1]] = task
    rows = results(run_rig, tasks, jobs, store, "plausible tracks")
    check_completed(rows.values(), "the same command goes on from there")
    return [rows[key] for key in keys]


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
        moved, reason = _rig(rig, dict(values * factors))
        if moved is None:
            raise InputError(f"{config.near.rig}: a neighbour cannot be built ({reason}); take a smaller share")
        rigs.append(moved)
    return rigs
