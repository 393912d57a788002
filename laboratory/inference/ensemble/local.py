"""Local searches of the ensemble: from the least excluded rigs of the waves to where fewer targets exclude."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from laboratory.inference.ensemble.history import READINGS, by_reading, deviation, judged, one_rig
from laboratory.inference.ensemble.settings import EnsembleConfig
from laboratory.inference.ensemble.stages import (
    FIRST,
    LAST,
    LOCAL,
    SHIPPED,
    SHIPPED_RIG,
    Ensemble,
    known_waves,
    read_errors,
)
from laboratory.inference.ensemble.waves import BELT_STEP, as_it_is, points_table, scene_fields, target_cases
from laboratory.inference.fit import FRAMES, GAP, first_that_runs
from laboratory.inference.search import End, Start, bent, search
from laboratory.inference.targets import Case, CaseTarget
from laboratory.inference.unknowns import Unknown, Unknowns
from trackdyn.errors import InputError
from trackdyn.measure.clearance import arc_gaps
from trackdyn.parameters.layout import can_close
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash
from trackdyn.sweeps.row import run_values

# Standard deviation of the neighbours of the default rig at which searches start, as a share of the range of every free
# unknown. The default rig is where a fit to other targets ended; from a small distance, searches end lower.
NEIGHBOURS_SD = 0.05
NEAR = "near_"  # and a number: the names of these starts


def rows_of_cases(memory: float) -> Callable[..., dict]:
    """What computes all cases of a rig as a row."""
    return _cases


def _cases(rig: dict, scenes: dict[str, dict], steps: list[float]) -> dict:
    made, starts = Rig.model_validate(rig), SettledLoops()
    least = Scene.ring_range(made)[0]
    found: dict[str, dict] = {}
    for name, fields in scenes.items():
        ring = fields["ring_radius"]
        untouched = ring is not None and fields.get("chain") != "belt" and ring < least
        fields = fields | ({"ring_radius": None} if untouched else {})
        own = [fields["step"]] if "step" in fields else steps
        found[name] = first_that_runs(own, partial(_case, made, fields, starts))
    return found


def _case(rig: Rig, fields: dict, starts: SettledLoops, step: float) -> dict:
    scene = Scene(rig, **fields | {"step": step})
    recording = simulate(scene, starts=starts)
    return run_values(recording) | (arc_gaps(recording, scene) if len(recording.frame) else {})


class EnsembleProblem:
    """The targets of an ensemble as a problem of `inference.search`."""

    def __init__(self, config: EnsembleConfig, unknowns: Unknowns, targets: Sequence[CaseTarget], errors: pd.DataFrame):
        self.config, self.unknowns, self.targets, self.errors = config, unknowns, targets, errors
        self.groups = [target.group for target in targets]
        self.rows, self.sources = rows_of_cases, module_hash(__name__)

    def task(self, x: np.ndarray) -> dict:
        """Arguments of the row of a point."""
        rig, scene = self.unknowns.to_rig(x)
        if not can_close(rig):
            raise InputError("the loop does not close within the travel of the tensioner")
        scenes = {}
        for case in target_cases(self.targets):
            fields: dict[str, Any] = scene_fields(self.config, self.unknowns, case, scene)
            more = {"integrator": self.config.cheap.integrator, "frame_interval": FRAMES}
            scenes[case.name] = fields | ({"step": BELT_STEP} if case.belt else more)
        return {"rig": rig.model_dump(), "scenes": scenes, "steps": self.config.cheap.steps_s}

    def residuals(self, values: dict) -> np.ndarray:
        """Implausibilities with their signs, large ones bent, by the better reading of the neighbour.

        A contact that is asked for and does not occur is further off by the gap that is left (`fit.GAP` each); what has
        no number without it counts as the cutoff and that gap.
        """
        rows = {name: pd.Series(row) for name, row in values.items()}
        outputs = one_rig(self.config, self.unknowns, self.targets, rows)
        found = np.empty((len(READINGS), len(self.targets)))
        for m, target in enumerate(self.targets):
            side = next((side for side in ("left", "right") if side in target.output), "")
            gap = values[target.case.name].get(f"{side}_gap_m", 0.0)
            for r, name in enumerate(by_reading(target)):
                off = float(target.departure(outputs[name]) / deviation(target, self.errors.loc[name]))
                off = -self.config.cutoff if np.isnan(off) else off
                found[r, m] = off - (gap / GAP if off < 0 and np.isfinite(gap) else 0.0)
        each = bent(found)
        return each[int((each**2).sum(axis=1).argmin())]


def ensemble_problem(config: dict, unknowns: list, rig: dict, targets: list, errors: dict) -> EnsembleProblem:
    """A problem from plain data."""
    return EnsembleProblem(
        EnsembleConfig.model_validate(config),
        Unknowns([Unknown.model_validate(one) for one in unknowns], Rig.model_validate(rig)),
        [CaseTarget.model_validate(one | {"case": Case(*one["case"])}) for one in targets],
        pd.DataFrame.from_dict(errors, orient="index"),
    )


def plain(e: Ensemble, errors: pd.DataFrame) -> dict:
    """What `ensemble_problem` is asked with, without how much is computed: a longer search goes on from a shorter."""
    return {
        "config": e.config.model_copy(update={"forms": {}}).model_dump(),
        "unknowns": [one.model_dump() for one in e.unknowns.unknowns],
        "rig": e.unknowns.rig.model_dump(),
        "targets": [one.model_dump() | {"case": list(one.case)} for one in e.targets],
        "errors": errors[["fidelity_sd", "discrepancy_sd"]].to_dict(orient="index"),
    }


def shipped_point(e: Ensemble) -> np.ndarray | None:
    """Where the rig as it ships lies; None where a value lies outside its range."""
    ((_, values),) = as_it_is(e.unknowns, SHIPPED_RIG)
    point = e.unknowns.position(values)
    return None if np.isnan(point).any() else point


def local_starts(e: Ensemble) -> list[Start]:
    """The rig as it ships where no value lies outside its range, the least excluded rigs of all waves, and neighbours
    of the first (`NEIGHBOURS_SD`).

    A choice stays what it is in each.
    """
    free = [not unknown.discrete for unknown in e.unknowns.unknowns]
    starts, near = {}, {}
    if (own := shipped_point(e)) is not None:
        starts[SHIPPED] = own
        random = np.random.default_rng(e.config.seed)
        moved = random.normal(own, NEIGHBOURS_SD, (e.form.local_neighbours, len(own)))
        near = {f"{NEAR}{k}": x for k, x in enumerate(np.clip(np.where(free, moved, own), 0.0, 1.0))}
    points, values = known_waves(e, LAST)
    ranked = judged(e.config, e.targets, values, read_errors(e), cheap=True).sort_values("loss")
    at = points.set_index("rig").loc[ranked.index[: e.form.local_starts - len(starts)], e.unknowns.labels]
    starts |= {str(rig): x for rig, x in zip(at.index, at.to_numpy(), strict=True)} | near
    return [Start(name, [float(v) for v in x], free) for name, x in starts.items()]


def local_ends(e: Ensemble, jobs: int, store: Path | str, log=print) -> list[End]:
    """Where searches from `local_starts` end, the least excluded first."""
    form = e.form
    return search(
        ensemble_problem, plain(e, read_errors(e)), local_starts(e), form.local_rounds, e.config.method,
        e.config.radius, form.local_directions, jobs, store, log,
    )  # fmt: skip


def local_points(e: Ensemble, ends: Sequence[End]) -> pd.DataFrame:
    """Points of the ends of all searches that ran, for the last wave.

    Of the neighbours only those of the last round: the others are still one rig, many times, and what is said of the
    ranges would be said of where they were drawn.
    """
    last = max((end.round for end in ends), default=0)
    kept = [end for end in ends if np.isfinite(end.cost) and (end.round == last or not end.start.startswith(NEAR))]
    return points_table(e.unknowns, np.array([end.x for end in kept]).reshape(-1, len(e.unknowns)), FIRST[LOCAL])
