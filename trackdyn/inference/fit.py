"""The documented fit of the rig's unknown parameters to printed results, and their sensitivity.

The paper's rig is not published. What is fitted, to what, between which bounds and with what budget
stands in ``config/fit.yaml``; some claims are held out and only reported. A fit chooses one rig that
shows the printed behaviour; it does not measure the paper's.
"""

from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field, model_validator
from scipy.optimize import brentq, least_squares

from trackdyn.errors import InputError, TrackdynError
from trackdyn.inference.targets import Target
from trackdyn.inference.unknowns import Unknown, Unknowns
from trackdyn.measure.meshing import mean_events, meshing_summary, smoothed_maxima
from trackdyn.measure.stopping import StopRule, run_steady, steady_fields
from trackdyn.parameters.groove import equal_pitch_radius
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Section
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.engine import refuse_failed, results
from trackdyn.sweeps.row import row_sources
from trackdyn.sweeps.store import DONE, key_of

# residual of a measure that does not exist (no such contact) or of a rig that cannot run, in tolerances
FAILED = 10.0


class Fitted(Unknown):
    """An unknown that is fitted, and the value at which its fit begins."""

    start: float

    @model_validator(mode="after")
    def _starts_inside(self):
        if not self.intervals or np.isnan(self.position(self.start)):
            raise InputError(f"parameters: {self.label or '?'} needs low < high and a start between them")
        return self


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


class FitConfig(Section):
    """Everything in ``config/fit.yaml``."""

    speed_rpm: Annotated[float, Field(gt=0)]
    loop_turns: Annotated[int, Field(ge=0)]
    lead_in_s: Annotated[float, Field(ge=0)]
    step_s: Annotated[float, Field(gt=0)]
    max_iterations: Annotated[int, Field(ge=1)]
    difference: Annotated[float, Field(gt=0, lt=0.5)]
    parameters: Annotated[list[Fitted], Field(min_length=1)]
    targets: Annotated[list[FitTarget], Field(min_length=1)]

    def restricted(self, radii: list[float], without_ring: bool) -> "FitConfig":
        """The same with the targets of some ring radii only; no radii: all of them."""
        if not radii:
            return self
        if set(radii) - {t.ring_radius_m for t in self.targets}:
            raise InputError(f"sensitivity.radii_m = {radii} is not accepted: no target of the fit has such a radius")
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


def with_values(rig: Rig, config: FitConfig, x) -> Rig:
    """The rig with every fitted parameter at a position ``x`` (0 to 1) between its bounds."""
    return Unknowns(config.parameters, rig).to_rig(x)[0]


def rows_of_cases(memory: float) -> Callable[..., dict]:
    """What computes the rows of `measure_rigs`; none takes much memory."""
    return _case


def _case(rig: dict, radius: float | None, speed_rpm: float, loop_turns: int, lead_in_s: float, step_s: float) -> dict:
    made = Rig.model_validate(rig)
    duration = round((loop_turns + 1) * made.loop_period(speed_rpm) * made.sensor.rate) / made.sensor.rate
    return meshing_summary(simulate(Scene(made, speed_rpm, radius, duration=duration, lead_in=lead_in_s, step=step_s)))


def measure_rigs(rigs: list[Rig | None], config: FitConfig, jobs: int = 1, store: Path | str | None = None):
    """Meshing summaries in every case, one dict ``radius -> summary or None`` a rig; None for one that cannot be.

    Raises
    ------
    TrackdynError
        A case failed for a reason that may pass; what ``store`` holds is not computed again.
    """
    fields = config.model_dump(include={"speed_rpm", "loop_turns", "lead_in_s", "step_s"})
    tasks, keys, sources = {}, [], row_sources("inference/fit.py")
    for rig in rigs:
        of_rig = [fields | {"rig": rig.model_dump(), "radius": radius} for radius in config.cases()] if rig else []
        keys.append([key_of(task, sources) for task in of_rig])
        tasks |= zip(keys[-1], of_rig, strict=True)
    found = results(rows_of_cases, tasks, jobs, store)
    refuse_failed(found.values(), "the same command goes on from there")
    summaries = {key: row["values"] if row["state"] == DONE else None for key, row in found.items()}
    return [dict(zip_longest(config.cases(), [summaries[key] for key in of_rig])) for of_rig in keys]


def measured(target: FitTarget, summaries: dict) -> float:
    """What a target's measure came out as; NaN if the case failed or has no such contact."""
    summary = summaries[target.ring_radius_m]
    if summary is None:
        return float("nan")
    value = summary[target.output]
    if target.relative_to is not None:
        reference = summaries[target.relative_to]
        value = value / reference[target.output] if reference and reference[target.output] else float("nan")
    return float(value)


def residual(target: FitTarget, summaries: dict) -> float:
    """Distance from the target in tolerances; 0 beyond a one-sided target."""
    value = measured(target, summaries)
    if not np.isfinite(value):
        return FAILED
    return float(np.clip(target.departure(value) / target.tolerance, -FAILED, FAILED))


def residuals(config: FitConfig, summaries: dict) -> np.ndarray:
    """Residuals of the targets that are fitted."""
    return np.array([residual(t, summaries) for t in config.targets if not t.held_out])


def fit_rig(
    rig: Rig, config: FitConfig, jobs: int = 1, log=print, store: Path | str | None = None
) -> tuple[Rig, pd.DataFrame]:
    """Bounded nonlinear least squares (``scipy.optimize.least_squares``) from the values ``start``.

    Returns
    -------
    rig : Rig
        The rig with the fitted values.
    history : DataFrame
        Cost and values of every evaluation, in order.
    """
    history = []

    def candidate(x):
        try:
            return with_values(rig, config, x)
        except TrackdynError:
            return None

    def evaluate(points):
        out = [residuals(config, found) for found in measure_rigs(list(map(candidate, points)), config, jobs, store)]
        for x, found in zip(points, out, strict=True):
            values = {p.label: p.value(v) for p, v in zip(config.parameters, x, strict=True)}
            history.append({"cost": 0.5 * float(found @ found)} | values)
        log(f"{len(history)} evaluations, best cost {min(row['cost'] for row in history):.3f}")
        return out

    def jacobian(x):
        steps = np.where(x + config.difference <= 1.0, config.difference, -config.difference)
        points = [x] + [x + step * unit for step, unit in zip(steps, np.eye(len(x)), strict=True)]
        base, *moved = evaluate(points)
        # a difference across a refusal is no derivative: it is taken to the other side
        for i, found in enumerate(moved):
            other = x - steps[i] * np.eye(len(x))[i]
            if (np.abs(found) >= FAILED).any() and not (np.abs(base) >= FAILED).any() and 0.0 <= other[i] <= 1.0:
                steps[i] = -steps[i]
                (moved[i],) = evaluate([other])
        return np.column_stack([(m - base) / step for m, step in zip(moved, steps, strict=True)])

    start = np.clip([p.position(p.start) for p in config.parameters], 0.001, 0.999)
    result = least_squares(
        lambda x: evaluate([x])[0],
        start,
        jac=jacobian,
        bounds=(0.0, 1.0),
        loss="soft_l1",
        max_nfev=config.max_iterations,
        xtol=1e-3,
        ftol=1e-3,
    )
    return with_values(rig, config, result.x), pd.DataFrame(history)


def report_targets(config: FitConfig, summaries: dict) -> pd.DataFrame:
    """Every target with what came out: ``claim, ring_radius_m, measure, target, ..., in tolerances``."""
    rows = []
    for t in config.targets:
        asked = {"relative_to": t.relative_to, "kind": t.rule, "target": t.printed, "tolerance": t.tolerance}
        came = {"measured": measured(t, summaries), "in_tolerances": residual(t, summaries), "held_out": t.held_out}
        rows.append(t.key | asked | came)
    return pd.DataFrame(rows)


AS_IT_IS = "as it is"


def changes(rig: Rig, config: FitConfig, factor: float = 1.2) -> dict[str, tuple[float, float]]:
    """Value of every fitted parameter, and the one that its sensitivity is taken with.

    A parameter stepped by ``log`` is multiplied by ``factor``, a linear one moved by a tenth of its range.
    """
    present = Unknowns(config.parameters, rig).of_rig(rig)
    found = {}
    for parameter in config.parameters:
        base, ends = present[parameter.label], parameter.intervals
        moved = base * factor if parameter.scale == "log" else base + 0.1 * (ends[-1][1] - ends[0][0])
        found[parameter.label] = base, moved
    return found


def equal_pitches(rig: Rig, printed: float = 0.308) -> dict[str, tuple[float, float]]:
    """Polygonal and arc radius (m) of the fitted equal pitch and of the two readings of "equal pitch at ``printed``".

    Polygonal: pins on a circle, links touching the ring at their middle. Arc: the centre line of the
    links bent to a circle of the same length; the polygonal radius that gives it is found here.
    """

    def arc(polygonal: float) -> float:
        candidate = rig.changed(sprocket__equal_pitch_radius=polygonal)
        c, teeth = candidate.chain, rig.sprocket.teeth
        return equal_pitch_radius(teeth, c.link_length, candidate.connector_length, c.link_thickness)["arc"]

    for_arc = float(brentq(lambda r: arc(r) - printed, printed - 0.01, printed, xtol=1e-7))
    readings = {"fitted": rig.sprocket.equal_pitch_radius, "arc length": for_arc, "polygonal": printed}
    return {name: (value, arc(value)) for name, value in readings.items()}


def candidates(rig: Rig, config: FitConfig) -> dict[str, Rig]:
    """The rig as it is, with every fitted parameter changed alone, and with each other reading of its equal pitch."""
    unknowns = Unknowns(config.parameters, rig)
    present = unknowns.of_rig(rig)
    rigs = {AS_IT_IS: rig}
    for name, (_, moved) in changes(rig, config).items():
        rigs[name] = rig.changed(**unknowns.changes(present | {name: moved})[0])
    readings = {name: value for name, (value, _) in equal_pitches(rig).items() if name != "fitted"}
    return rigs | {name: rig.changed(sprocket__equal_pitch_radius=value) for name, value in readings.items()}


def measure_candidates(rig: Rig, config: FitConfig, radius: float | None, step: float, rule: StopRule) -> pd.DataFrame:
    """Meshing summary of every candidate in one case of the fit, run until it has converged.

    Columns ``candidate, ring_radius_m, failed`` (why there is none) and those of `meshing_summary`.
    """
    rows = []
    for name, candidate in candidates(rig, config).items():
        row = {"candidate": name, "ring_radius_m": radius, "failed": ""}
        try:
            fields = steady_fields(candidate, config.speed_rpm, rule)
            recording, _ = run_steady(Loop(Scene(candidate, config.speed_rpm, radius, step=step, **fields)), rule)
            rows.append(row | meshing_summary(recording))
        except TrackdynError as error:
            rows.append(row | {"failed": str(error)})
    return pd.DataFrame(rows)


def summaries_of(table: pd.DataFrame) -> dict[str, dict]:
    """Rows of `measure_candidates` of all cases as ``candidate -> radius -> summary or None``."""
    found: dict[str, dict] = {}
    for row in table.to_dict("records"):
        radius = None if pd.isna(row["ring_radius_m"]) else row["ring_radius_m"]
        failed = isinstance(row["failed"], str) and row["failed"]
        found.setdefault(row["candidate"], {})[radius] = None if failed else row
    return found


def sensitivity(rig: Rig, config: FitConfig, summaries: dict[str, dict]) -> pd.DataFrame:
    """Change of every target's measure when one fitted parameter changes (`changes`), the others held.

    Returns
    -------
    DataFrame
        ``parameter, base_value, changed_value, claim, ring_radius_m, measure, base, changed, change,
        change_in_tolerances``.
    """
    rows = []
    for name, (value, moved) in changes(rig, config).items():
        for t in config.targets:
            base, changed = measured(t, summaries[AS_IT_IS]), measured(t, summaries[name])
            seen = {"base": base, "changed": changed, "change": changed - base}
            about = {"parameter": name, "base_value": value, "changed_value": moved} | t.key
            rows.append(about | seen | {"change_in_tolerances": (changed - base) / t.tolerance})
    return pd.DataFrame(rows)


def equal_pitch_readings(rig: Rig, summaries: dict[str, dict]) -> pd.DataFrame:
    """Both readings of the printed equal pitch (`equal_pitches`) put into the rig, beside the fitted value.

    Returns
    -------
    DataFrame
        ``reading, polygonal_m, arc_m`` and, for each case of the fit, the shares of left and right arc.
    """
    rows = []
    for reading, (polygonal, arc) in equal_pitches(rig).items():
        row = {"reading": reading, "polygonal_m": polygonal, "arc_m": arc}
        for radius, summary in summaries[AS_IT_IS if reading == "fitted" else reading].items():
            name = "none" if radius is None else f"{radius:g}"
            for side in ("left", "right"):
                row[f"{side}_share_pct_{name}"] = summary[f"{side}_share_pct"] if summary else float("nan")
        rows.append(row)
    return pd.DataFrame(rows)


def run_directions(rig: Rig, config: FitConfig, step: float, rule: StopRule) -> pd.DataFrame:
    """Events of C16 and C17 for the chain descending and climbing on the sprocket.

    The paper does not say which way its chain runs. The mirrored rig (idler and road wheel on the other
    side of the sprocket) runs the other way; belt kinematics give it the same main line.

    Returns
    -------
    DataFrame
        ``chain, ring, event, mean_s, sd_s`` for both readings of a maximum.
    """
    mirrored = rig.changed(
        idler__x=2 * rig.sprocket.x - rig.idler.x,
        road_wheel__x=2 * rig.sprocket.x - rig.road_wheel.x,
        tension__direction=180.0 - rig.tension.direction,
    )
    tables = []
    for candidate in (rig, mirrored):
        # clockwise, so the sprocket's outer side descends if the other wheels stand to its left
        descends = candidate.road_wheel.x < candidate.sprocket.x
        for radius in (None, rig.sprocket.ring_radius):
            pitches = tuple(range(1, rig.chain.pitches + 1))
            fields = steady_fields(candidate, config.speed_rpm, rule)
            recording, _ = run_steady(
                Loop(Scene(candidate, config.speed_rpm, radius, step=step, pitches=pitches, **fields)), rule
            )
            events = pd.concat([mean_events(recording), smoothed_maxima(recording)])
            events.insert(0, "ring", "none" if radius is None else f"{radius:g} m")
            events.insert(0, "chain", "descends" if descends else "climbs")
            tables.append(events)
    return pd.concat(tables, ignore_index=True)
