"""Waves of rigs: points of the unit cube become scenes of a sweep, and its rows the numbers of each rig."""

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc

from laboratory.inference.ensemble.settings import EnsembleConfig, EnsembleForm, Fidelity
from laboratory.inference.targets import Case, CaseTarget
from laboratory.inference.unknowns import Unknowns, buildable
from trackdyn.errors import TrackdynError
from trackdyn.parameters.layout import belt_around, wheel_names
from trackdyn.parameters.rig import Rig
from trackdyn.sweeps.store import DONE

# the radii over which C24 takes its mean
SPREAD_CLAIM = "C24"
# points that are drawn for one that is kept: half of all grooves cannot be cut, a third of all loops not closed
DRAWN = 8
BELT_STEP = 0.001  # s between the samples of a path
AFTER_KIND = ": "  # in the name of a row


def target_cases(targets: Sequence[CaseTarget]) -> list[Case]:
    """Cases that the targets need, in a fixed order."""
    return sorted({target.case for target in targets}, key=lambda case: (case.belt, case.rpm, case.ring or 0.0))


def study_cases(form: EnsembleForm, ring: float) -> list[Case]:
    """Every ring and none at every speed of the study, and the paper's ring at every speed of the records."""
    cases = [Case(rpm, radius) for rpm in form.speeds_rpm for radius in (None, *form.radii_m)]
    return list(dict.fromkeys([*cases, *(Case(rpm, ring) for rpm in form.records_rpm)]))


def points_table(unknowns: Unknowns, points: np.ndarray, first: int) -> pd.DataFrame:
    """Points as a table: ``rig`` counted from ``first``, and a column an unknown with its position in 0 to 1."""
    rigs = pd.RangeIndex(first, first + len(points), name="rig")
    return pd.DataFrame(points, columns=unknowns.labels, index=rigs).reset_index()


def prior_points(unknowns: Unknowns, count: int, seed: int) -> np.ndarray:
    """(count, d) buildable points of a Latin hypercube."""
    drawn = qmc.LatinHypercube(len(unknowns), seed=seed).random(DRAWN * count)
    kept = list(islice((x for x in drawn if buildable(unknowns, x)), count))
    if len(kept) < count:
        raise TrackdynError(
            f"of {len(drawn)} points of the unknowns' ranges only {len(kept)} give a groove; change the ranges"
        )
    return np.array(kept)


def members(unknowns: Unknowns, points: pd.DataFrame) -> list[tuple[int, dict]]:
    """Number and values of every rig of a table of points."""
    return [(int(point[0]), unknowns.values(point[1:])) for point in points.itertuples(index=False)]


def as_it_is(unknowns: Unknowns, number: int) -> list[tuple[int, dict]]:
    """The unknowns' own rig with its values, inside their ranges or not, and the first alternative of every choice."""
    choices = {one.label: next(iter(one.choices)) for one in unknowns.unknowns if one.discrete}
    return [(number, unknowns.of_rig(unknowns.rig) | choices)]


def same_loss(rig: Rig, rpm: float, fields: Mapping[str, Any]) -> dict[str, float]:
    """Parameters of another law of drag or of bushings with which it loses what the rig's own law loses at a speed.

    A wheel bears the tension times the angle that the chain wraps, as a belt does: its rolling resistance is that
    load times the lever arm. A bushing is turned at the frequency at which pitches pass.
    """
    found: dict[str, float] = {}
    period = rig.loop_period(rpm) / rig.chain.pitches
    speed = (rig.chain.link_length + rig.connector_length) / period
    if fields.get("drag") in ("viscous", "coulomb"):
        path, order = belt_around(rig)
        for circle, which in enumerate(order):
            if which:  # not the sprocket
                name = wheel_names(rig)[which]
                wheel = getattr(rig, name)
                rate = speed / wheel.radius
                torque = wheel.rolling_arm * rig.tension.pre_tension * float(path.wrap[circle]) + wheel.seal_drag * rate
                if fields["drag"] == "viscous":
                    found[f"{name}.bearing_drag"] = torque / rate
                else:
                    found[f"{name}.bearing_torque"] = torque
    if fields.get("bushing_law") == "viscous":
        found["bushing.damping"] = rig.bushing.loss_factor * rig.bushing.stiffness * period / (2 * np.pi)
    return found


def wave_design(
    config: EnsembleConfig, unknowns: Unknowns, rigs: Sequence[tuple[int, dict]], cases: Sequence[Case], fields: dict
):
    """A row a rig and case for `trackdyn.sweeps`.

    ``fields`` of the scene are shared by all rows but the belts; names are ``<rig> <case>``, steps are missing.
    """
    rows = []
    for rig, values in rigs:
        changes, scene = unknowns.changes(values)
        if {"drag", "bushing_law"} & fields.keys():
            changes = changes | same_loss(unknowns.rig.changed(**changes), config.speed_rpm, fields)
        for case in cases:
            row = scene_fields(config, unknowns, case, scene | fields)
            row["ring_radius"] = "none" if case.ring is None else repr(case.ring)
            if "pitches" in row:
                row["pitches"] = " ".join(map(str, row["pitches"]))
            rows.append({"name": f"{rig} {case.name}"} | row | changes)
    return pd.DataFrame(rows)


def scene_fields(config: EnsembleConfig, unknowns: Unknowns, case: Case, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of the scene of a case; ``fields``: of the rig's choices and of laws, which a belt lacks."""
    row: dict[str, Any] = {"motor_rpm": case.rpm, "ring_radius": case.ring}
    if case.belt:  # a path: neither forces nor a tensioner
        return row | {"chain": "belt", "spells": False, "duration": config.belt_s, "tension": "locked"}
    turn = unknowns.rig.loop_period(case.rpm) * unknowns.rig.sprocket.teeth / unknowns.rig.chain.pitches
    row |= {"chain": "double_pin", "spells": True, "duration": round(config.record_turns * turn, 3)}
    row |= {"lead_in": config.lead_in_s, "pitches": list(range(1, unknowns.rig.chain.pitches + 1))}
    return row | config.own_laws | fields


def as_chains(config: EnsembleConfig, belts: pd.DataFrame) -> pd.DataFrame:
    """Rows of belts as chains with the paper's ring, for as long: what the belt leaves out of the dominant peak."""
    return belts.assign(
        chain="double_pin", ring_radius=repr(config.ring_radius_m), lead_in=config.lead_in_s, pitches="", spells=True
    )


def rows_of_kind(
    config: EnsembleConfig,
    unknowns: Unknowns,
    rigs: Sequence[tuple[int, dict]],
    cases: Sequence[Case],
    kind: str,
    fidelity: Fidelity,
    belts_as_chains: bool = False,
    **fields,
) -> pd.DataFrame:
    """Rows of every case of every rig, each with the steps that are tried on it until it comes out.

    The kind stands before the names of rows (`unknown_kinds`). ``belts_as_chains``: only the cases of belts, with all
    forces (`as_chains`).
    """
    rows = wave_design(config, unknowns, rigs, cases, {"integrator": fidelity.integrator} | fields)
    if belts_as_chains:
        rows = as_chains(config, rows[rows["chain"] == "belt"]).assign(integrator=fidelity.integrator)
    steps = np.where(rows["chain"] == "belt", repr(BELT_STEP), " ".join(map(repr, fidelity.steps_s)))
    return rows.assign(name=f"{kind}{AFTER_KIND}" + rows["name"], step=steps)


def unknown_kinds(results: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Results of every kind of rows (`rows_of_kind`)."""
    parts = results["name"].str.partition(AFTER_KIND)
    return {kind: rows.assign(name=parts.loc[rows.index, 2]) for kind, rows in results.groupby(parts[0])}


def by_case(results: pd.DataFrame) -> dict[int, dict[str, pd.Series]]:
    """Rows that came out: rig, then name of the case."""
    done = results[results["state"] == DONE]
    parts = done["name"].str.partition(" ")
    found: dict[int, dict[str, pd.Series]] = {}
    for (_, row), rig, case in zip(done.iterrows(), parts[0], parts[2], strict=True):
        found.setdefault(int(rig), {})[case] = row
    return found


def rig_at(unknowns: Unknowns, point: pd.Series) -> Rig:
    """The rig of a row of a table of points."""
    return unknowns.to_rig(point[unknowns.labels].to_numpy(dtype=float))[0]
