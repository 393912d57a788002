"""The stages of an ensemble, each from files to files: rigs compared in all fidelities, waves, the last wave, the study
of radii.

``compared`` shows what cheap runs and other laws change, ``1`` is drawn from the prior ranges, every later wave from
the search between the waves, ``local`` is where searches from the least excluded of these end (`local`), ``last`` runs
those and the least excluded rigs at full fidelity, ``study`` runs rings and speeds with them, ``shipped`` is the rig as
it ships, for comparison, and ``conflicts`` searches for rigs that show claims which none of these shows together
(`conflicts`).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from laboratory.inference.ensemble.history import Search, errors, judged, outputs
from laboratory.inference.ensemble.settings import EnsembleConfig, EnsembleForm, load_ensemble, targets_of, unknowns_of
from laboratory.inference.ensemble.waves import (
    as_it_is,
    members,
    points_table,
    prior_points,
    rows_of_kind,
    study_cases,
    target_cases,
    unknown_kinds,
)
from laboratory.inference.targets import Case, CaseTarget
from laboratory.inference.unknowns import Unknowns
from replication.paper.claims import load_claims
from trackdyn.errors import InputError
from trackdyn.sweeps.table import write_table

COMPARED, LOCAL, LAST, STUDY, SHIPPED = "compared", "local", "last", "study", "shipped"
CONFLICTS = "conflicts"
SHIPPED_RIG = -1  # its number
CHEAP, FULL, CHAIN, LAW = "cheap", "full", "chain", "law"  # kinds of rows
FIRST = {COMPARED: 0, CONFLICTS: 700_000, LOCAL: 800_000, LAST: 900_000}  # number of the first rig of a stage
EACH_WAVE = 10_000  # wave k begins at k times this
FROM_BEST = 0.5  # of the last wave: rigs of the waves before; the others are new


class Ensemble(NamedTuple):
    """What all stages share."""

    config: EnsembleConfig
    form: EnsembleForm
    unknowns: Unknowns
    targets: list[CaseTarget]
    rig: str
    folder: Path

    @property
    def waves(self) -> list[str]:
        """Names of the waves."""
        return [str(k + 1) for k in range(len(self.form.waves))]

    def read(self, name: str) -> pd.DataFrame:
        """A table that a stage before has written."""
        return pd.read_csv(self.folder / f"{name}.csv")

    def outputs(self, stage: str) -> pd.DataFrame:
        """Outputs of a stage's rigs of which every run came out, by rig."""
        table = self.read(f"outputs_{stage}").set_index("rig")
        return table[table.pop("whole").astype(bool)]

    def runs(self, stage: str) -> dict[str, pd.DataFrame]:
        """Results of a stage by their kind: cheap, full, law 0 and so on."""
        return unknown_kinds(pd.read_parquet(self.folder / f"runs_{stage}.parquet"))


def open_ensemble(config: Path | str, form: str, rig: Path | str, claims: Path | str, folder: Path | str) -> Ensemble:
    """Settings read and checked."""
    settings = load_ensemble(config)
    if form not in settings.forms:
        raise InputError(f"{config}: form = {form!r}: choose {', '.join(settings.forms)}")
    targets = targets_of(settings, load_claims(claims))
    return Ensemble(settings, settings.forms[form], unknowns_of(settings, rig), targets, str(rig), Path(folder))


def known_waves(e: Ensemble, before: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Points and outputs of all waves before a stage, by the cheap fidelity."""
    names = [COMPARED, *(wave for wave in e.waves if before == LAST or int(wave) < int(before))]
    points = pd.concat([e.read(f"points_{name}") for name in names], ignore_index=True)
    values = pd.concat([e.outputs(name) for name in names])
    return points, values


def read_errors(e: Ensemble) -> pd.DataFrame:
    """``errors.csv`` by output."""
    return e.read("errors").set_index("output")


def stage_points(e: Ensemble, stage: str, progress: bool = False) -> tuple[pd.DataFrame, pd.DataFrame | None]:
    """Points of a stage and, where emulators chose them, what held-out points say of these; the shipped rig is no
    point.
    """
    seed = e.config.seed
    if stage == SHIPPED:
        return points_table(e.unknowns, np.zeros((0, len(e.unknowns))), 0), None
    if stage == COMPARED:
        return points_table(e.unknowns, prior_points(e.unknowns, e.form.compared, seed), FIRST[COMPARED]), None
    if stage == "1":
        return points_table(e.unknowns, prior_points(e.unknowns, e.form.waves[0], seed + 1), EACH_WAVE), None
    if stage == STUDY:  # the rigs of the last wave that the fewest targets exclude
        return e.read(f"points_{LAST}").set_index("rig").loc[rank(e).index[: e.form.studied]].reset_index(), None
    points, values = known_waves(e, stage)
    known = read_errors(e)
    search = Search(e.config, e.unknowns, e.targets, points, values, known)
    message = pd.DataFrame([
        {"output": name} | {of: getattr(check, of) for of in ("rmse", "r2", "coverage_95")}
        | {"held_out": len(check.standard_error)} for name, check in search.check().items()
    ])  # fmt: skip
    if stage == LAST:
        ranked = judged(e.config, e.targets, values, known, cheap=True).sort_values("loss")
        old = points.set_index("rig").loc[ranked.index[: round(FROM_BEST * e.form.last)]].reset_index()
        local = e.read(f"points_{LOCAL}")
        count = max(e.form.last - len(old) - len(local), 1)
        new = search.next_points(count, e.form.search_steps, seed + 99, progress)
        return pd.concat([old, local, points_table(e.unknowns, new, FIRST[LAST])], ignore_index=True), message
    k = int(stage)
    found = search.next_points(e.form.waves[k - 1], e.form.search_steps, seed + k, progress)
    return points_table(e.unknowns, found, k * EACH_WAVE), message


def rank(e: Ensemble) -> pd.DataFrame:
    """Rigs of the last wave, the ones that the fewest targets exclude first (`history.judged`)."""
    ranked = judged(e.config, e.targets, e.outputs(LAST), read_errors(e), cheap=False)
    return ranked.sort_values(["excluded_by", "loss"])


def stage_cases(e: Ensemble, stage: str) -> list[Case]:
    """Scenes of every rig of a stage."""
    return study_cases(e.form, e.config.ring_radius_m) if stage == STUDY else target_cases(e.targets)


def stage_rows(e: Ensemble, stage: str, points: pd.DataFrame) -> pd.DataFrame:
    """A stage's scenes of some rigs, as a design of a sweep."""
    requested = {FULL: (e.config.full, {})} if stage in (LAST, SHIPPED) else {CHEAP: (e.config.cheap, {})}
    if stage == STUDY:
        requested = {CHEAP: (e.config.cheap, {"sliding": True, "every_link": True})}
    if stage == COMPARED:
        requested |= {FULL: (e.config.full, {})}
        requested |= {CHAIN: (e.config.cheap, {"belts_as_chains": True})}
        requested |= {f"{LAW} {k}": (e.config.cheap, dict(law)) for k, law in enumerate(e.config.laws[: e.form.laws])}
    rigs = as_it_is(e.unknowns, SHIPPED_RIG) if stage == SHIPPED else members(e.unknowns, points)
    parts = [
        rows_of_kind(e.config, e.unknowns, rigs, stage_cases(e, stage), kind, fidelity, **fields)
        for kind, (fidelity, fields) in requested.items()
    ]
    return pd.concat(parts, ignore_index=True)


def gather_stage(e: Ensemble, stage: str) -> None:
    """Outputs of a stage's rigs, and after the first the errors of fidelity and laws, into the folder."""
    of = {kind: outputs(e.config, e.unknowns, e.targets, rows) for kind, rows in e.runs(stage).items()}
    write_table(of[FULL if stage in (LAST, SHIPPED) else CHEAP].reset_index(), e.folder / f"outputs_{stage}.csv")
    if stage == COMPARED:
        laws: Sequence[pd.DataFrame] = [of[kind] for kind in of if kind.startswith(LAW)]
        belts = [target.name for target in e.targets if target.case.belt]
        full = of[FULL].assign(**{name: of[CHAIN][name] if CHAIN in of else np.nan for name in belts})
        known = errors(of[CHEAP], full, of[CHEAP], laws)
        write_table(known.rename_axis("output").reset_index(), e.folder / "errors.csv")
