"""The documented fit of the rig's unknown parameters to printed results, and their sensitivity.

The paper's rig is not published. What is fitted, to what, between which bounds and with what budget
stands in ``config/fit.yaml``; some claims are held out and only reported. A fit chooses one rig that
shows the printed behaviour; it does not measure the paper's.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, model_validator
from scipy.stats import qmc

from laboratory.inference.search import End, Round, SearchMethod, Start, bent, search
from laboratory.inference.targets import Target, outside
from laboratory.inference.unknowns import Unknown, Unknowns, buildable
from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.measure.clearance import arc_gaps
from trackdyn.measure.meshing import area_shares, meshing_summary
from trackdyn.parameters.layout import can_close
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Positive, Section
from trackdyn.scene.scene import Scene
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash
from trackdyn.sweeps.engine import refuse_failed, results
from trackdyn.sweeps.store import DONE, key_of

# A contact that is asked for and does not occur: so many tolerances for what has no number then, such as its time.
MISSING = 3.0
# m: an arc that must come so much nearer to its groove is a tolerance further off; rings of the paper differ by it.
GAP = 1e-3
FRAMES = 0.02  # s between the configurations that gaps are taken from: 2.5 degrees of the sprocket at 115 rpm


class FitTarget(Target):
    """A target in a case of the fit; ``relative_to`` makes it a ratio to the same output at another ring radius."""

    ring_radius_m: float | None
    relative_to: float | None = None
    held_out: bool = False
    reason: Annotated[str, Field(min_length=1)]

    @property
    def key(self) -> dict:
        """Columns that say which target it is."""
        return {"claim": self.claim, "ring_radius_m": self.ring_radius_m, "measure": self.output}


class Run(Section):
    """How a rig is run: fields of the scene, and steps that are tried one after the other until it comes out (s)."""

    scene: dict[str, float | str]
    steps_s: Annotated[list[Positive], Field(min_length=1)]


class Stage(Section):
    """A search: rings that are run (none: all of the targets), how, and the rounds of the starts."""

    run: str
    radii_m: list[Positive] = Field(default_factory=list)
    radius: Positive = 0.1
    directions: Annotated[int, Field(ge=2)] | None = None
    rounds: Annotated[list[Round], Field(min_length=1)]


class FitForm(Section):
    """How much is computed: starts for each combination of the choices, and the stages."""

    starts: Annotated[int, Field(ge=0)]
    stages: Annotated[list[Stage], Field(min_length=1)]


class FitConfig(Section):
    """Everything in ``config/fit.yaml``, whose head explains the fields."""

    speed_rpm: Annotated[float, Field(gt=0)]
    seed: Annotated[int, Field(ge=0)]
    method: SearchMethod
    laws: dict[str, str]
    runs: dict[str, Run]
    full: str
    forms: dict[Literal["full", "short"], FitForm]
    parameters: Annotated[list[Unknown], Field(min_length=1)]
    choices: list[Unknown] = Field(default_factory=list)
    rigs: dict[str, dict[str, float | str]] = Field(default_factory=dict)
    targets: Annotated[list[FitTarget], Field(min_length=1)]

    @model_validator(mode="after")
    def _consistent(self):
        for unknown in self.parameters:
            if unknown.discrete or not unknown.intervals:
                raise InputError(f"parameters: {unknown.label or '?'} needs a range; fixed values belong in choices")
        requested = {self.full, *(stage.run for form in self.forms.values() for stage in form.stages)}
        if requested - set(self.runs):
            raise InputError(f"runs: {', '.join(sorted(requested - set(self.runs)))} is missing")
        return self

    def restricted(self, radii: list[float], without_ring: bool) -> "FitConfig":
        """The same with the targets of some ring radii only; no radii: all of them."""
        if not radii:
            return self
        if set(radii) - {t.ring_radius_m for t in self.targets}:
            raise InputError(f"sensitivity.radii_m = {radii}: no target of the fit has such a radius")
        kept = [
            t
            for t in self.targets
            if (without_ring if t.ring_radius_m is None else t.ring_radius_m in radii)
            and (t.relative_to is None or t.relative_to in radii)
        ]
        return self.model_copy(update={"targets": kept})

    def cases(self) -> list[float | None]:
        """Ring radii that the targets need, None for no ring."""
        radii = {t.ring_radius_m for t in self.targets} | {t.relative_to for t in self.targets if t.relative_to}
        return sorted(radii, key=lambda r: -1.0 if r is None else r)

    def unknowns(self, rig: Rig) -> Unknowns:
        """Parameters and choices of a rig."""
        return Unknowns([*self.parameters, *self.choices], rig)


def rows_of_fit(memory: float) -> Callable[..., dict]:
    """What computes the rows of `measure_rigs` and of the fit; none takes much memory."""
    return _rig


def _rig(rig: dict, radii: list[float | None], scene: dict, steps: list[float]) -> dict:
    """Summaries of a rig by the name of the case."""
    made, starts = Rig.model_validate(rig), SettledLoops()
    found: dict[str, dict] = {}
    least = Scene.ring_range(made)[0]
    for radius in radii:
        if radius is not None and radius < least and "none" in found:  # it never touches the chain: no ring
            found[f"{radius:g}"] = found["none"]
        else:
            found[name_of(radius)] = first_that_runs(steps, partial(_case, made, radius, scene, starts))
    return found


def name_of(radius: float | None) -> str:
    """Name of a case."""
    return "none" if radius is None else f"{radius:g}"


def first_that_runs(steps: Sequence[float], run: Callable[[float], dict]) -> dict:
    """What a run gives with the first step (s) that is not refused; the refusal of the last one."""
    *first, last = steps
    for step in first:
        with suppress(InputError, DivergenceError):
            return run(step)
    return run(last)


def _case(rig: Rig, radius: float | None, scene: dict, starts: SettledLoops, step: float) -> dict:
    requested = Scene(rig, ring_radius=radius, step=step, frame_interval=FRAMES, **scene)
    recording = simulate(requested, starts=starts)
    return case_summary(recording) | arc_gaps(recording, requested)


def case_summary(recording: Recording) -> dict:
    """Numbers of a case that targets are compared with."""
    return meshing_summary(recording) | area_shares(recording)


def task_of(config: FitConfig, rig: Rig, run: str, scene: dict[str, Any]) -> dict:
    """Arguments of the row of a rig."""
    if not can_close(rig):
        raise InputError("the loop does not close within the travel of the tensioner")
    how = config.runs[run]
    pitches = list(range(1, rig.chain.pitches + 1))
    fields = {"motor_rpm": config.speed_rpm, "pitches": pitches} | config.laws | how.scene | scene
    return {"rig": rig.model_dump(), "radii": config.cases(), "scene": fields, "steps": how.steps_s}


def summaries_by_radius(config: FitConfig, values: dict) -> dict:
    """Summaries of a row by ring radius."""
    return {radius: values[name_of(radius)] for radius in config.cases()}


def measure_rigs(
    rigs: Sequence[tuple[Rig, dict[str, Any]]],
    config: FitConfig,
    jobs: int = 1,
    store: Path | str | None = None,
    run: str | None = None,
):
    """Summaries of rigs with fields of their scenes in every case, one dict ``radius -> summary or None`` a rig.

    What ``store`` holds is not computed again.
    """
    sources = module_hash(__name__)
    tasks = [task_of(config, rig, run or config.full, scene) for rig, scene in rigs]
    keys = [key_of(task, sources) for task in tasks]
    found = results(rows_of_fit, dict(zip(keys, tasks, strict=True)), jobs, store)
    refuse_failed(found.values(), "the same command goes on from there")
    lost = dict.fromkeys(config.cases())
    return [summaries_by_radius(config, found[k]["values"]) if found[k]["state"] == DONE else lost for k in keys]


def measured(target: FitTarget, summaries: dict) -> float:
    """What a target's measure came out as; NaN if the case failed or has no such contact."""
    summary = summaries[target.ring_radius_m]
    if summary is None:
        return float("nan")
    share = outside(summary, target.output)
    value = summary[target.output] if share is None else share
    if target.relative_to is not None:
        reference = summaries[target.relative_to]
        value = value / reference[target.output] if reference and reference[target.output] else float("nan")
    return float(value)


def residual(target: FitTarget, summaries: dict) -> float:
    """Signed distance from the target in tolerances; 0 beyond a one-sided target; NaN if the case failed.

    Notes
    -----
    A contact that is asked for and does not occur is further off by the gap that is left, in units of `GAP`; what has
    no number without it counts as `MISSING` tolerances and that gap.
    """
    summary = summaries[target.ring_radius_m]
    if summary is None:
        return float("nan")
    value = measured(target, summaries)
    off = float(target.departure(value) / target.tolerance) if np.isfinite(value) else -MISSING
    gap = summary.get(f"{target.output.partition('_')[0]}_gap_m", 0.0)
    if off < 0 and np.isfinite(gap):
        off -= gap / GAP
    return off


def residuals(config: FitConfig, summaries: dict) -> np.ndarray:
    """Residuals of the targets that are fitted, large ones bent (`search.bent`)."""
    return bent([residual(t, summaries) for t in config.targets if not t.held_out])


class FitProblem:
    """The fit as a problem of `inference.search`."""

    def __init__(self, config: FitConfig, rig: Rig, run: str, held: dict[str, str]):
        self.config, self.run, self.held = config, run, held
        self.unknowns = config.unknowns(rig)
        self.rows, self.sources = rows_of_fit, module_hash(__name__)

    def task(self, x: np.ndarray) -> dict:
        """Arguments of the row of a point."""
        rig, scene = self.unknowns.to_rig(x)
        return task_of(self.config, rig, self.run, scene | self.held)

    def residuals(self, values: dict) -> np.ndarray:
        """Of the fitted targets."""
        return residuals(self.config, summaries_by_radius(self.config, values))


def fit_problem(config: dict, rig: dict, run: str, held: dict[str, str]) -> FitProblem:
    """A problem from plain data; ``held``: fields of the scene that no choice changes."""
    return FitProblem(FitConfig.model_validate(config), Rig.model_validate(rig), run, held)


def starts_of(config: FitConfig, rig: Rig, count: int) -> list[Start]:
    """Where the fit begins: Sobol points that can be built, so many a combination of choices, and the named rigs."""
    unknowns = config.unknowns(rig)
    d, free = len(config.parameters), [True] * len(config.parameters) + [False] * len(config.choices)
    choices = list(product(*(one.choices for one in config.choices)))
    found = []
    if count:
        drawn = iter(qmc.Sobol(d, seed=config.seed).random_base2(int(np.ceil(np.log2(40 * count * len(choices))))))
        for number, chosen in product(range(count), choices):
            places = [one.position(name) for one, name in zip(config.choices, chosen, strict=True)]
            for point in drawn:
                x = [*np.round(point, 6).tolist(), *places]
                if buildable(unknowns, x):
                    found.append(Start(" ".join([*chosen, str(number + 1)]), x, free))
                    break
            else:
                raise TrackdynError(
                    "hardly any point of the ranges gives a rig; other ranges of the parameters are needed"
                )
    base = unknowns.of_rig(rig)
    for name, values in config.rigs.items():
        x = unknowns.position(base | values)
        for place, label in zip(x, unknowns.labels, strict=True):
            if np.isnan(place):
                raise InputError(f"rigs: {name}: {label} = {(base | values)[label]} lies outside its range")
        found.append(Start(name, x.tolist(), free))
    return found


def fit_rig(
    rig: Rig,
    config: FitConfig,
    form: str = "full",
    jobs: int = 1,
    log=print,
    store: Path | str | None = None,
    held: dict[str, str] | None = None,
    starts: Sequence[Start] | None = None,
) -> tuple[Rig, dict[str, str], list[list[End]]]:
    """Least squares from many starts (`inference.search`), stage by stage.

    Parameters
    ----------
    form : str
        ``full`` or ``short``.
    held : dict or None
        Fields of the scene that no choice changes: other laws than ``laws``.
    starts : sequence of Start or None
        In place of those of the configuration, such as the rig that was found before under another law.

    Returns
    -------
    rig : Rig
        The best rig of the last stage.
    scene : dict
        Fields of the scene that its choices ask for.
    ends : list of list of End
        Every start of every stage. A stage begins at the ends of those that the last round of the one before kept.
    """
    chosen = config.forms[form]
    begins = list(starts) if starts is not None else starts_of(config, rig, chosen.starts)
    stages: list[list[End]] = []
    for number, stage in enumerate(chosen.stages, 1):
        small = config.restricted(stage.radii_m, without_ring=True)
        # without what says how long is searched: a longer search has the rows of a shorter
        plain = small.model_copy(update={"forms": {}, "rigs": {}}).model_dump()
        given = {"config": plain, "rig": rig.model_dump(), "run": stage.run, "held": held or {}}
        log(f"stage {number}: {len(begins)} starts, {len(small.cases())} cases, run {stage.run}")
        how = config.method, stage.radius, stage.directions
        ends = search(fit_problem, given, begins, stage.rounds, *how, jobs, store, log)
        stages.append(ends)
        going = [end for end in ends if end.round == ends[0].round and np.isfinite(end.cost)][: stage.rounds[-1].keep]
        free = {start.name: start.free for start in begins}
        begins = [Start(end.start, end.x, free[end.start]) for end in going]
        if not begins:
            raise TrackdynError(f"no start of stage {number} runs: {ends[0].ended}")
    found, scene = config.unknowns(rig).to_rig(begins[0].x)
    return found, scene, stages


def report_targets(config: FitConfig, summaries: dict) -> pd.DataFrame:
    """Every target with what came out: ``claim, ring_radius_m, measure, target, ..., in tolerances``."""
    rows = []
    for t in config.targets:
        requested = {"relative_to": t.relative_to, "kind": t.rule, "target": t.printed, "tolerance": t.tolerance}
        came = {"measured": measured(t, summaries), "in_tolerances": residual(t, summaries), "held_out": t.held_out}
        rows.append(t.key | requested | came)
    return pd.DataFrame(rows)
