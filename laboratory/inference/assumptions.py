"""The map from assumptions to claims: the rig with one assumption changed, fitted again, and judged by the ring study
and the meshing process.

What a law or a reading makes true or costs is seen only where everything else may follow: a change that is not fitted
again says how far the base was fitted to its own choices.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from trackdyn.errors import InputError, TrackdynError
from trackdyn.files import write_text
from laboratory.inference.fit import FitConfig, Form, Stage, fit_rig
from laboratory.inference.search import Round, Start
from laboratory.inference.unknowns import Unknown, Unknowns
from trackdyn.measure.stopping import StopRule, steady_fields
from replication.paper.claims import NOT_COMPARABLE, Claim, distance, judge
from replication.paper.evidence import Evidence
from replication.paper.measures import MEASURES
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.validation import Positive, Section, not_one_of, validated
from trackdyn.parameters.yaml_file import read_yaml
from laboratory.studies.departures import Lines, run_in_a_copy
from trackdyn.sweeps.engine import refuse_failed, results
from trackdyn.sweeps.row import Rows, row_sources
from trackdyn.sweeps.store import DONE, key_of

BASE = "base"
YARDSTICK = "refit alone"  # the base fitted again as the alternatives are: what the refit itself moves
FAILED = "failed"  # in place of a verdict: a run that the claim needs did not come out
EVENT = "event "  # before the names of events in a row
COLUMNS = [
    "group", "assumption", "instead_of", "outside", "claim", "id", "origin", "text", "rpm", "measured", "verdict",
    "distance", "reason",
]  # fmt: skip


class Alternative(Section):
    """One assumption changed; ``config/assumptions.yaml`` explains the fields."""

    scene: dict[str, str] = Field(default_factory=dict)
    rig: dict[str, float | Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(default_factory=dict)
    unknowns: list[Unknown] = Field(default_factory=list)
    without: list[str] = Field(default_factory=list)
    silent: list[str] = Field(default_factory=list)
    outside: str = ""
    lines: Lines | None = None


class Group(Section):
    """An assumption: what the base has, and the alternatives to it."""

    name: str
    base: str
    others: Annotated[dict[str, Alternative], Field(min_length=1)]


class Refit(Section):
    """A stage of the fit (`fit.Stage`) without its rounds."""

    run: str
    radii_m: list[Positive]
    radius: Positive
    directions: Annotated[int, Field(ge=2)]


class MapForm(Section):
    """How much is run: speeds and radii of the ring study, evaluations of a refit (0: none), ``only`` one alternative
    (its group and its name), and fields of the scene that differ from the base's.
    """

    speeds_rpm: Annotated[list[Positive], Field(min_length=1)]
    radii_m: Annotated[list[Positive], Field(min_length=1)]
    evaluations: Annotated[int, Field(ge=0)]
    only: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None
    scene: dict[str, str] = Field(default_factory=dict)


class Named(NamedTuple):
    """An alternative with its names; the base has the group ``base`` and no alternative."""

    group: str
    name: str
    instead_of: str
    alternative: Alternative

    @property
    def slug(self) -> str:
        """A name for files."""
        words = "".join(c if c.isalnum() or c == "." else " " for c in f"{self.group} {self.name}").split()
        return "_".join(words)


class AssumptionsConfig(Section):
    """Everything in ``config/assumptions.yaml``, whose head explains the fields."""

    scene: dict[str, str]
    steps_s: Annotated[list[Positive], Field(min_length=1)]
    known: StopRule
    claims: Annotated[list[Annotated[str, Field(pattern=r"^C\d\d$")]], Field(min_length=1)]
    speed_rpm: Positive
    ring_radius_m: Positive
    refit: Refit
    forms: dict[Literal["full", "short"], MapForm]
    groups: Annotated[list[Group], Field(min_length=1)]

    @model_validator(mode="after")
    def _consistent(self):
        names = [group.name for group in self.groups]
        if len(set(names)) < len(names) or {BASE, YARDSTICK} & {*names}:
            raise InputError(f"groups: names are {', '.join(names)}; they differ, none is {BASE!r} or {YARDSTICK!r}")
        for group in self.groups:
            if group.base in group.others:
                raise InputError(f"groups: {group.name}: {group.base} is the base's; it is no alternative")
        for form in self.forms.values():
            if form.only and form.only not in [[one.group, one.name] for one in self._all()]:
                raise InputError(f"forms: only = {form.only}: a group and one of its others")
            if self.speed_rpm not in form.speeds_rpm or self.ring_radius_m not in form.radii_m:
                raise InputError("forms: speeds_rpm and radii_m hold speed_rpm and ring_radius_m")
        return self

    def _all(self) -> list[Named]:
        return [Named(g.name, name, g.base, other) for g in self.groups for name, other in g.others.items()]

    def assumptions(self, form: str) -> list[Named]:
        """The base, the base fitted again if alternatives are, and the alternatives of a form."""
        asked = self.forms[form]
        first = [Named(BASE, "", "", Alternative())]
        if asked.evaluations:
            first.append(Named(YARDSTICK, "refitted", "the base", Alternative()))
        return first + [one for one in self._all() if asked.only is None or [one.group, one.name] == asked.only]


def load_assumptions(path: Path | str) -> AssumptionsConfig:
    """Read and validate ``config/assumptions.yaml``."""
    return validated(AssumptionsConfig, read_yaml(path), str(path))


def named(config: AssumptionsConfig, form: str, slug: str) -> Named:
    """The assumption of a form that has this name for files.

    Raises
    ------
    InputError
        There is none.
    """
    found = {one.slug: one for one in config.assumptions(form)}
    if slug not in found:
        raise InputError(f"assumption {not_one_of(slug, found)}")
    return found[slug]


def changed_rig(rig: Rig, alternative: Alternative) -> Rig:
    """The rig with the fields that an alternative changes, and what it makes unknown within its range."""
    if alternative.rig:
        one = Unknown(name="it", choices={"as it is": {}, "changed": dict(alternative.rig)})
        fields, _ = Unknowns([one], rig).changes({"it": "changed"})
        rig = rig.changed(**fields)
    unknowns = Unknowns(alternative.unknowns, rig)
    inside = {u.label: nearest(u, v) for u, v in zip(unknowns.unknowns, unknowns.of_rig(rig).values(), strict=True)}
    return rig.changed(**unknowns.changes(inside)[0])


def nearest(unknown: Unknown, value: float) -> float:
    """The value of the unknown's ranges that is nearest to one."""
    ends = [float(np.clip(value, low, high)) for low, high in unknown.intervals]
    return min(ends, key=lambda end: abs(end - value))


def parameters_of(alternative: Alternative, fit: FitConfig) -> list[Unknown]:
    """What is fitted under an alternative: the parameters of the fit but for those that it sets, lacks or replaces."""
    own = [name for unknown in alternative.unknowns for name in unknown.names]
    fixed = {*alternative.rig, *alternative.without, *own}
    return [*(unknown for unknown in fit.parameters if not fixed & {*unknown.names}), *alternative.unknowns]


def refit(
    rig: Rig, scene: dict[str, str], alternative: Alternative, config: AssumptionsConfig, fit: FitConfig,
    evaluations: int, store: Path | str | None = None, log=print,
) -> Rig:  # fmt: skip
    """The rig fitted to the targets of the fit, from where it stands and within the ranges of the parts.

    Raises
    ------
    TrackdynError
        The start does not run.
    """
    asked = config.refit
    stage = Stage(**asked.model_dump(), rounds=[Round(evaluations=max(evaluations, 2))])
    changes: dict[str, Any] = {
        "parameters": parameters_of(alternative, fit), "choices": [], "rigs": {},
        "laws": scene_laws(scene, fit, asked.run),
        "forms": {"full": Form(starts=0, stages=[stage])},
        "targets": [target for target in fit.targets if target.claim not in alternative.silent],
    }  # fmt: skip
    small = fit.model_copy(update=changes)
    unknowns = small.unknowns(rig)
    values = unknowns.of_rig(rig)
    begin = unknowns.position({u.label: nearest(u, values[u.label]) for u in unknowns.unknowns})
    start = Start("base", np.clip(begin, 0.0, 1.0).round(9).tolist(), [True] * len(unknowns))
    found, _, _ = fit_rig(rig, small, "full", jobs=1, log=log, store=store, starts=[start])
    return found


def scene_laws(scene: dict[str, str], fit: FitConfig, run: str) -> dict[str, str]:
    """Laws of a scene without what the run of the fit says itself."""
    return {name: word for name, word in scene.items() if name not in fit.runs[run].scene}


def cases(config: AssumptionsConfig, form: MapForm) -> Iterator[tuple[float, float | None]]:
    """Speeds (rev/min) and radii (m; None: no ring) that are run, neighbours alike."""
    for radius in [None, *form.radii_m]:
        for rpm in form.speeds_rpm:
            yield rpm, radius


def run_rows(
    rig: Rig, scene: dict[str, Any], config: AssumptionsConfig, form: MapForm, jobs: int = 1,
    store: Path | str | None = None,
) -> list[dict]:  # fmt: skip
    """Every case as ``rpm, ring_radius_m, state, reason`` and, where it came out, its metrics and events.

    Raises
    ------
    TrackdynError
        A row failed for a reason that may pass; what ``store`` holds is not computed again.
    """
    known = config.known.model_dump(exclude={"longest_turns"})
    plain, tasks, rows = rig.model_dump(), {}, []
    for rpm, radius in cases(config, form):
        fields = {
            "motor_rpm": rpm, "ring_radius": radius, "step": config.steps_s,
            "pitches": list(range(1, rig.chain.pitches + 1)),
        } | steady_fields(rig, rpm, config.known) | scene  # fmt: skip
        task = {"rig": plain, "changes": {}, "scene": fields, "until": {}, "known": known, "longest": 0.0}
        key = key_of(task, row_sources())
        tasks[key] = task
        rows.append({"key": key, "rpm": rpm, "ring_radius_m": radius})
    found = results(Rows, tasks, jobs, store)
    refuse_failed(found.values(), "the same command goes on from there")
    kept = ("state", "reason", "cost")
    return [found[row["key"]]["values"] | {name: found[row["key"]][name] for name in kept} | row for row in rows]


def run_assumption(
    rig: Rig, one: Named, config: AssumptionsConfig, fit: FitConfig, form: MapForm, jobs: int = 1,
    store: Path | str | None = None, log=print,
) -> dict:  # fmt: skip
    """The rig that an assumption leads to, its scene, its rows, and why it was not fitted again, if so.

    Returns
    -------
    dict
        ``rig``, ``scene``, ``values`` (by label, what is fitted), ``refit`` (what became of it) and ``rows``
        (`run_rows`), plain data.
    """
    scene = config.scene | form.scene | one.alternative.scene
    said = "none"
    if one.group != BASE:
        rig = changed_rig(rig, one.alternative)
        if form.evaluations:
            try:
                rig = refit(rig, scene, one.alternative, config, fit, form.evaluations, store, log)
                said = f"{form.evaluations} evaluations"
            except TrackdynError as error:
                said = f"none: {error}"
    rows = run_rows(rig, scene, config, form, jobs, store)
    values = Unknowns(parameters_of(one.alternative, fit), rig).of_rig(rig)
    return {"rig": rig.model_dump(), "scene": scene, "values": values, "refit": said, "rows": rows}


def evidence(found: dict, config: AssumptionsConfig, rpm: float | None = None) -> Evidence:
    """What an assumption's rows say: of all speeds, or of one as if the meshing process had been run at it.

    At another speed than that of the meshing process the times of events are those of the same angles of the sprocket:
    a second there is ``speed / rpm`` of one here. Rows without values are NaN.
    """
    at = config.speed_rpm if rpm is None else rpm
    metrics, events = [], []
    for row in found["rows"]:
        ring = row["ring_radius_m"]
        if rpm is None or row["rpm"] == rpm:
            study = f"ring/{row['rpm']:g}rpm_{'none' if ring is None else f'{ring:g}'}"
            metrics.append(row | {"run": study})
        if row["rpm"] == at and ring in (None, config.ring_radius_m):
            run = "meshing/no_ring" if ring is None else "meshing/ring"
            metrics.append(row | {"run": run})
            times = {name.removeprefix(EVENT): value for name, value in row.items() if name.startswith(EVENT)}
            events += [
                {"run": run, "event": name, "mean_s": np.nan if value is None else value * at / config.speed_rpm}
                for name, value in times.items()
            ]
    return Evidence(
        metrics=pd.DataFrame(metrics),
        events=pd.DataFrame(events, columns=["run", "event", "mean_s"]),
        rig=Rig.model_validate(found["rig"]),
        rpm=at,
        radius=config.ring_radius_m,
    )


def _lost(claim: Claim, found: dict, config: AssumptionsConfig, speeds) -> str:
    """Why a claim cannot be judged at some speeds: the first run among those that it looks at that has no values."""
    study = MEASURES[claim.measure].table == "study"
    for row in found["rows"]:
        ring = row["ring_radius_m"]
        looked_at = ring is not None if study else ring in (None, config.ring_radius_m)
        if row["rpm"] in speeds and looked_at and row["state"] != DONE:
            name = "no ring" if ring is None else f"{ring:g} m"
            return f"{name}, {row['rpm']:g} rpm: {row['state']}: {row['reason']}"
    return ""


def judge_assumption(one: Named, found: dict, claims: list[Claim], config: AssumptionsConfig) -> pd.DataFrame:
    """Every claim of the map under an assumption: as the scorecard has it (``rpm`` NaN), and at each speed.

    Returns
    -------
    DataFrame
        ``COLUMNS``. A claim whose runs did not all come out is ``failed``, with the reason. The meshing process is
        judged at its own speed and, in units of a turn, at the others.
    """
    rows = []
    speeds = sorted({row["rpm"] for row in found["rows"]})
    whole = evidence(found, config)
    at_speeds = {rpm: evidence(found, config, rpm) for rpm in speeds}
    for claim in claims:
        if claim.id not in config.claims or claim.id in one.alternative.silent or claim.measure is None:
            continue
        meshing = MEASURES[claim.measure].table == "meshing"
        about = {"group": one.group, "assumption": one.name, "instead_of": one.instead_of}
        about |= {"outside": one.alternative.outside, "claim": claim.name, "id": claim.id}
        about |= {"origin": claim.origin, "text": claim.claim}
        for rpm in (None, *speeds):
            e = whole if rpm is None else at_speeds[rpm]
            if rpm is not None and not meshing:
                e = Evidence(e.metrics, e.events, e.rig, config.speed_rpm, e.radius)
            judged = judge(claim, e)
            if rpm is not None and judged.verdict == NOT_COMPARABLE:
                continue  # it is judged over several speeds, or not at this one
            why = _lost(claim, found, config, judged.speeds)
            value = {"measured": "", "verdict": FAILED, "distance": np.nan} if why else {
                "measured": judged.measured, "verdict": judged.verdict, "distance": distance(claim, e),
            }  # fmt: skip
            rows.append(about | {"rpm": np.nan if rpm is None else rpm} | value | {"reason": why})
    return pd.DataFrame(rows, columns=COLUMNS)


def run_named(
    rig: str | Path, assumptions: str | Path, fit: str | Path, form: str, slug: str, store: str | Path, out: str | Path
) -> None:
    """Run an assumption by its files and write what was found as JSON; in a copy of the package if it adds lines."""
    config = load_assumptions(assumptions)
    one = named(config, form, slug)
    arguments = [str(Path(part).resolve()) for part in (rig, assumptions, fit)]
    arguments += [form, slug, *(str(Path(part).resolve()) for part in (store, out))]
    if one.alternative.lines is not None:
        run_in_a_copy(one.alternative.lines, __name__, arguments)
    else:
        main(arguments)


def main(arguments: list[str]) -> None:
    """What `run_named` does in this package: rig, assumptions, fit, form, slug, store, file to write."""
    rig, assumptions, fit, form, slug, store, out = arguments
    config = load_assumptions(assumptions)
    targets = validated(FitConfig, read_yaml(fit), fit)
    one = named(config, form, slug)
    found = run_assumption(load_rig(rig), one, config, targets, config.forms[form], store=store, log=_to_screen)
    write_text(out, json.dumps(found, default=lambda number: number.item()))


def _to_screen(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
