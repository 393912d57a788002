"""Ring study (Sect. 6.2) of any rig: every ring and none at every speed, until the contacts converge."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import typed
from trackdyn.measure.columns import METRIC_COLUMNS
from trackdyn.measure.metrics import total_errors
from trackdyn.measure.ring_rule import ROUNDS, RULE_COLUMNS, RingRule, with_tooth_forces
from trackdyn.measure.stopping import check_driven
from trackdyn.rig.rig import Rig, parameter_table
from trackdyn.rig.rig_file import DEFAULT
from trackdyn.scene.rings import least_ring, study_radii
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.sweeps.engine import DONE, check_completed
from trackdyn.sweeps.sweep import computed_rows, row_of

SCENE_COLUMNS, OUTCOME_COLUMNS = ["rpm", "load_n", "ring_radius_m"], ["added", "state", "reason", "contacts_converged"]


@typed
def ring_study(
    rig: Rig,
    speeds: Sequence[float],
    radii: Sequence[float] | None = None,
    jobs: int | None = None,
    store: Path | str | None = None,
    progress: bool = False,
    step: Sequence[float] = (),
    rule: RingRule | None = None,
    loads: Sequence[float] | None = None,
) -> pd.DataFrame:
    """Run every ring, and none, at every speed and load.

    Radii are in m (by default `scene.rings.study_radii`), speeds in rev/min, loads, pulls of the chain (`Scene.load`),
    in N, the rig's own by default. ``jobs, store, progress`` are as in `sweep`: a killed study resumes from its store.
    Of several steps (s) the first is used that is neither refused nor diverges; by default the rig's own. Radii around
    the choice of a ``rule`` are added (`RingRule.refined`).

    The table has a row per scene, no ring first: ``rpm``, ``load_n``, ``ring_radius_m`` (empty: no ring), ``added``
    (whether the study took that radius on its way), ``state``, ``reason``, ``contacts_converged``, the columns of
    ``metrics.csv`` and ``key``, and those of `with_tooth_forces`; errors include that of the step
    (`measure.uncertainty`). Raises `InputError`: a speed, a load or a radius cannot be used, or no ring for a ``rule``
    carries the chain; `TrackdynError`: a scene failed for a reason that may pass. The ``reason`` of a scene that is
    refused or diverges is in its row.
    """
    requested = study_radii(rig) if radii is None else sorted(set(radii))
    radii, (low, high) = list(requested), Scene.ring_range(rig)
    rpms, pulls = sorted(set(speeds)), [rig.load] if loads is None else sorted(set(loads))
    if rule and radii and radii[-1] < (least := least_ring(rig)) and radii[0] >= low:
        remedy = f"a ring carries the chain from {least:.5g} m on; give larger radii"
        raise InputError(f"radii: the largest, {radii[-1]:.5g} m, carries nothing: {remedy}")

    def run(radii: Sequence[float]) -> pd.DataFrame:
        scenes = [Scene(rig, rpm, ring, load=load) for ring in (None, *radii) for load in pulls for rpm in rpms]
        table = with_tooth_forces(_study(scenes, step, jobs, store, progress))
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


def other_grips(
    rig: Rig, study: pd.DataFrame, radius: float, jobs: int | None, store: Path, progress: bool, step: Sequence[float]
) -> pd.DataFrame:
    """Run a ring with Dahl's law, soft and hard in shear, and return a row for each.

    Speed and load are those with the largest ``tooth_ratio``, the stiffnesses the ends of the range of the default
    rig's file. The table has `ring_study`'s columns and ``shear_stiffness`` (N/m a link).
    """
    rows = study[study["ring_radius_m"] == radius]
    worst = rows.loc[rows["tooth_ratio"].idxmax()]
    rpm, load = float(worst["rpm"]), float(worst["load_n"])
    ranges = parameter_table(DEFAULT).set_index("name")[["low", "high"]]
    stiffnesses = ranges.loc["ring_contact.shear_stiffness"].astype(float).tolist()
    others = [rig.changed(ring_contact__friction_law="dahl", ring_contact__shear_stiffness=k) for k in stiffnesses]
    bare = study[study["ring_radius_m"].isna() & (study["rpm"] == rpm) & (study["load_n"] == load)]
    table = _study([Scene(other, rpm, radius, load=load) for other in others], step, jobs, store, progress)
    return with_tooth_forces(pd.concat([bare, table])).iloc[len(bare) :].assign(shear_stiffness=stiffnesses)


def _study(scenes: list[Scene], step: Sequence[float], jobs, store, progress: bool) -> pd.DataFrame:
    """Return the table of scenes of one sprocket, by radius, load and speed. Raises `InputError` as `check_driven`."""
    rig = scenes[0].rig
    rule, contents = StopRule(passages=rig.sprocket.teeth), {id(scene.rig): scene.rig.model_dump() for scene in scenes}
    stop_rule = {name: float(getattr(rule, name)) for name in ("share_pct", "force", "passages")}
    steps = {"step": float(step[0]) if len(step) == 1 else list(map(float, step))} if step else {}
    rows = []
    for scene in scenes:
        check_driven(scene)  # before anything runs
        fields: dict = {"motor_rpm": scene.motor_rpm, "ring_radius": scene.ring_radius}
        fields |= {} if scene.load == scene.rig.load else {"load": scene.load}
        fields |= steady_fields(rig, scene.motor_rpm, rule) | steps
        rows.append(row_of({"rig": contents[id(scene.rig)], "changes": {}, "scene": fields, "stop_rule": stop_rule}))
    results = computed_rows(rows, jobs, store, "ring" if progress else "")
    check_completed(results, "run the study again: stored rows are reused")  # no ring is judged without its neighbours
    outcomes = pd.DataFrame(results).drop(columns="values")
    table = pd.DataFrame([result["values"] for result in results]).assign(**outcomes)
    table[SCENE_COLUMNS] = np.array([(s.motor_rpm, s.load, s.ring_radius) for s in scenes], float)
    metrics = [name for name in table if name in METRIC_COLUMNS and name not in (*SCENE_COLUMNS, "run")]
    errors = {name: error for name in metrics if (error := METRIC_COLUMNS[name][3]) in table}
    for k in table.index[table["state"] == DONE]:
        row, whole = table.loc[k], total_errors(scenes[k].with_(step=table.loc[k, "step_s"]))
        table.loc[k, list(errors.values())] = [whole(name, row[name], row[error]) for name, error in errors.items()]
    columns = [*SCENE_COLUMNS, *OUTCOME_COLUMNS, *dict.fromkeys((*metrics, *RULE_COLUMNS)), "key"]
    return table.reindex(columns=columns).sort_values(SCENE_COLUMNS[::-1], na_position="first", ignore_index=True)
