"""The ring study (Sect. 6.2) of any rig: every ring and none at every speed, each until its contacts are known."""

from collections.abc import Sequence
from math import isnan
from pathlib import Path

import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import typed
from trackdyn.measure.columns import METRIC_COLUMNS
from trackdyn.measure.metrics import whole_errors
from trackdyn.measure.ring_rule import ROUNDS, RULE_COLUMNS, RingRule
from trackdyn.measure.stopping import check_driven
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.rings import study_radii
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.sweeps.design import read_table
from trackdyn.sweeps.engine import DONE
from trackdyn.sweeps.sweep import check_replaceable, requested_rows, sweep

SCENE_COLUMNS, OUTCOME_COLUMNS = ["rpm", "ring_radius_m"], ["added", "state", "reason", "contacts_converged"]


def _design(rig: Rig, speeds: Sequence[float], radii: Sequence[float], step: Sequence[float]) -> pd.DataFrame:
    """The scenes of a study, a row each. Raises `InputError`: a speed or a radius cannot be used."""
    rings = [None, *radii]
    for ring in rings:  # before anything runs
        for rpm in speeds:
            check_driven(Scene(rig, rpm, ring))
    rule = StopRule(passages=rig.sprocket.teeth)
    stop_rule = {f"stop_rule.{name}": getattr(rule, name) for name in ("share_pct", "force", "passages")}
    rows = [
        {"motor_rpm": rpm, "ring_radius": "none" if ring is None else ring} | steady_fields(rig, rpm, rule) | stop_rule
        for ring in rings
        for rpm in sorted(set(speeds))
    ]
    return pd.DataFrame(rows).assign(**({"step": " ".join(map(str, step))} if step else {}))


def check_same_study(
    path: Path | str, rig: Path | str, speeds: Sequence[float], radii: Sequence[float], step: Sequence[float] = ()
) -> None:
    """Refuse (`InputError`) to replace the table of another study: one with a run that this one does not ask for.

    ``path`` is the table, other arguments are those of `ring_study`. Radii that a study adds on its way belong to it.
    """
    check_replaceable(path, Path(path).parent / "rows")
    if not Path(path).exists():
        return
    table, loaded = read_table(path), load_rig(rig)
    further = set[float]()
    if "added" in table:
        added = table.loc[table["added"].astype(str) == "True", "ring_radius_m"]
        further = set(pd.to_numeric(added, errors="coerce").dropna()) - set(radii)
    due = {row.key for row in requested_rows(_design(loaded, speeds, [*radii, *sorted(further)], step), str(rig))}
    if others := len(set(table["key"]) - due):
        raise InputError(
            f"{path}: {others} of its runs are of another rig or version, or of speeds, radii or steps that are not "
            "asked for; give another folder, or `overwrite: true` to replace the study"
        )


@typed
def ring_study(
    rig: Path | str,
    speeds: Sequence[float],
    radii: Sequence[float] | None = None,
    jobs: int | None = None,
    store: Path | str | None = None,
    progress: bool = False,
    step: Sequence[float] = (),
    rule: RingRule | None = None,
) -> pd.DataFrame:
    """Run every ring (radii in m; by default `scene.rings.study_radii`), and none, at every speed (rev/min).

    ``jobs, store, progress`` are as in `sweep`: a killed study goes on from its store. Of several steps (s) the first
    counts that is neither refused nor diverges; by default the rig's own. Around the choice of a ``rule`` radii are run
    that it needs (`RingRule.refined`).

    The table has a row per scene, no ring first: ``rpm``, ``ring_radius_m`` (empty: no ring), ``added`` (whether the
    study took that radius on its way), ``state``, ``reason``,
    ``contacts_converged``, the columns of ``metrics.csv`` and ``key``; errors hold what the step
    adds (`measure.uncertainty`). Raises `InputError` where the rig, a speed or a radius cannot be used; what is wrong
    with one scene is its ``reason``.
    """
    loaded = load_rig(rig)
    requested = study_radii(loaded) if radii is None else sorted(set(radii))
    radii, high = list(requested), Scene.ring_range(loaded)[1]

    def run(radii: Sequence[float]) -> pd.DataFrame:
        table = _study(loaded, rig, _design(loaded, speeds, radii, step), jobs, store, progress)
        table["added"] = table["ring_radius_m"].notna() & ~table["ring_radius_m"].isin(requested)
        return table

    study = run(radii)
    for _ in range(ROUNDS):
        more = [radius for radius in rule.refined(study) if radius <= high] if rule else []
        if not more:
            break
        radii = sorted({*radii, *more})
        study = run(radii)
    return study


def _study(loaded: Rig, rig: Path | str, design: pd.DataFrame, jobs, store, progress: bool) -> pd.DataFrame:
    table = sweep(design, rig=rig, jobs=jobs, store=store, progress=progress)
    table["rpm"], table["ring_radius_m"] = design["motor_rpm"], pd.to_numeric(design["ring_radius"], errors="coerce")
    metrics = [name for name in table if name in METRIC_COLUMNS and name not in (*SCENE_COLUMNS, "run")]
    errors = {name: error for name in metrics if (error := METRIC_COLUMNS[name][3]) in table}
    for k, row in table[table["state"] == DONE].iterrows():
        ring = None if isnan(row["ring_radius_m"]) else row["ring_radius_m"]
        whole = whole_errors(Scene(loaded, row["rpm"], ring, step=row["step_s"]))
        table.loc[k, list(errors.values())] = [whole(name, row[name], row[error]) for name, error in errors.items()]
    columns = [*SCENE_COLUMNS, *OUTCOME_COLUMNS, *dict.fromkeys((*metrics, *RULE_COLUMNS)), "key"]
    return table.reindex(columns=columns).sort_values(SCENE_COLUMNS[::-1], na_position="first", ignore_index=True)
