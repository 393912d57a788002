"""Lives of many rigs: what came of them, which first radius keeps the good window longest, what a sensor sees of it."""

from collections.abc import Mapping, Sequence
from io import StringIO
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.measure.meshing import NEAR_LEAST, TOUCHING
from trackdyn.parameters.rig import Rig
from trackdyn.study.settings import WearForm, WearPlan
from trackdyn.study.wear.law import Coefficients, load_coefficients
from trackdyn.study.wear.life import SENSED, Limits, Until, Worn, live
from trackdyn.sweeps.engine import results
from trackdyn.sweeps.row import row_sources
from trackdyn.sweeps.store import key_of

OF_A_LIFE = ["rig", "rpm", "tension", "first_radius_m"]
SAME = 1e-6  # m
BAND = 0.15  # of the RMS force of the left arc, as C24 has it
PROFILES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the life


def lives_of(memory: float):
    """What computes a life, for `sweeps.engine`."""

    def compute(rig: dict, rpm: float, coefficients: dict, fields: dict, until: list, factor: float) -> dict:
        worn = Worn(Rig.model_validate(rig), rpm, Coefficients(**coefficients), fields)
        table = live(worn, Until(*until), Limits().times(factor))
        depths = np.vstack(list(table["depths"]))
        share = table["distance_km"] / (table["distance_km"].iloc[-1] or 1.0)
        at = [[np.interp(one, share, node) for node in depths.T] for one in PROFILES]
        flanks = [[row[f.start : f.stop] for f in worn.depths.flanks] for row in at]
        told = table.drop(columns=["depths", "rates", "request", "next_m"])
        return {"rows": told.to_json(orient="records", double_precision=15), "flanks": flanks}

    return compute


def run_lives(
    rigs: Sequence[tuple[str, Rig, Mapping, WearPlan]],
    form: WearForm,
    store: Path | str | None = None,
    jobs: int = 1,
) -> tuple[pd.DataFrame, dict[tuple, list]]:
    """Lives of every rig at every speed, tension and first radius of its plan.

    Parameters
    ----------
    rigs : sequence
        Name, rig, fields of the scene that go with it, which may hold the tension, and plan.
    store : path or None
        Folder in which lives are kept as they come.

    Returns
    -------
    DataFrame
        A row a state of each life (`life.live`) with ``rig, rpm, tension, first_radius_m`` and ``life``, the share of
        the life; ``end`` stands in the last one. A rig that does not run new has one row with the reason.
    dict
        Depths (m) of both flanks at ``PROFILES`` of the life, by life.
    """
    asked, coefficients, sources = {}, load_coefficients().model_dump(), row_sources("study/wear")
    for name, rig, own, plan in rigs:
        tensions = [own["tension"]] if "tension" in own else plan.tensions
        for rpm, tension, radius in product(plan.speeds_rpm, tensions, plan.first_radii_m):
            task = {
                "rig": rig.changed(sprocket__ring_radius=radius).model_dump(mode="json"), "rpm": rpm,
                "coefficients": coefficients, "fields": {"integrator": plan.integrator, "step": plan.step_s}
                | dict(own) | {"tension": tension}, "until": ["ring", form.until_radius_m], "factor": form.step_factor,
            }  # fmt: skip
            asked[key_of(sources, task)] = (name, rpm, tension, radius), task
    rows = results(lives_of, {key: task for key, (_, task) in asked.items()}, jobs, store, "wear", "life")
    found, flanks = [], {}
    for key, (life, _) in asked.items():
        values = rows[key]["values"]
        table = pd.DataFrame([{"distance_km": 0.0, "end": f"does not run new: {rows[key]['reason']}"}])
        if values:
            table, flanks[life] = pd.read_json(StringIO(values["rows"]), orient="records"), values["flanks"]
        share = table["distance_km"] / (table["distance_km"].iloc[-1] or 1.0)
        table = table.assign(life=share, cpu_s=rows[key]["cost"].get("cpu_s", np.nan))
        found.append(table.assign(**dict(zip(OF_A_LIFE, life, strict=True))))
    return pd.concat(found, ignore_index=True), flanks


def summarize(lives: pd.DataFrame) -> pd.DataFrame:
    """A row a life: kilometres, why it ended, and until when the window was good.

    The window is that of C26: right arc free, left share within 2 points of the least that the rig shows at this speed
    with this tension. ``right_begins_m`` is the radius at which the right arc begins to touch, ``left_leaves_m`` that
    at which the RMS force of the left arc leaves its band about that of the new ring, ``good_km`` what the chain ran in
    the window.
    """
    rows = []
    ran = lives.dropna(subset=["left_share_pct"]) if "left_share_pct" in lives else lives.iloc[:0]
    least = ran.groupby(OF_A_LIFE[:3])["left_share_pct"].min()
    for life, table in lives.groupby(OF_A_LIFE, sort=False):
        row = dict(zip(OF_A_LIFE, life, strict=True)) | {"end": table["end"].iloc[-1]}
        if "left_share_pct" in table and table["left_share_pct"].notna().all():
            touches = table["right_share_pct"] >= TOUCHING
            good = ~touches & (table["left_share_pct"] <= least[life[:3]] + NEAR_LEAST)
            step = table["distance_km"].diff().shift(-1).fillna(0.0)
            leaves = (table["left_rms_n"] / table["left_rms_n"].iloc[0] - 1.0).abs() > BAND
            row |= {
                "life_km": table["distance_km"].iloc[-1], "last_radius_m": table["ring_radius_m"].iloc[-1],
                "right_begins_m": table.loc[touches, "ring_radius_m"].max(),
                "left_leaves_m": table.loc[leaves, "ring_radius_m"].max(), "good_km": float(step[good].sum()),
                "good_share": float(step[good].sum() / (step.sum() or 1.0)), "cpu_s": table["cpu_s"].iloc[0],
                "left_depth_m": table["left_depth_m"].iloc[-1], "right_depth_m": table["right_depth_m"].iloc[-1],
            }  # fmt: skip
        rows.append(row)
    return pd.DataFrame(rows)


def answer(summary: pd.DataFrame, printed: float = 0.308) -> str:
    """Which first radius stays longest in the good window, and how many rigs agree with the printed one (m)."""
    ran = summary.dropna(subset=["good_km"]) if "good_km" in summary else summary.iloc[:0]
    ran = ran[ran["good_km"] > 0]
    if ran.empty:
        return f"Of {summary['rig'].nunique()} rigs none has a life in the good window."
    best = ran.loc[ran.groupby(OF_A_LIFE[:3])["good_km"].idxmax(), [*OF_A_LIFE, "good_km"]]
    agree = best["first_radius_m"].sub(printed).abs() < SAME
    words = [
        f"{one.rig}, {one.rpm:g} rpm, {one.tension}: {one.first_radius_m:g} m stays longest, {one.good_km:.3g} km."
        for one in best.itertuples()
        if not one.rig.startswith("ensemble")
    ]
    return (
        f"The printed {printed:g} m is the first radius that stays longest in the good window in {agree.sum()} of "
        f"{len(best)} cases of {best['rig'].nunique()} rigs ({summary['rig'].nunique()} were run). "
    ) + " ".join(words)


def sensed(lives: pd.DataFrame) -> pd.DataFrame:
    """What a sensor on a link sees of each life: change of a measure, and the least change of the radius that it shows.

    ``detectable_mm`` is that change of the radius at which the measure changes by the half width of the 95 %
    interval of a difference of two records.
    """
    rows = []
    for life, table in lives.groupby(OF_A_LIFE, sort=False):
        if len(table) < 2:  # it does not run, or leaves the model at once
            continue
        fall = table["ring_radius_m"].iloc[0] - table["ring_radius_m"].iloc[-1]
        for name in SENSED:
            change = table[f"{name}_g"].iloc[-1] - table[f"{name}_g"].iloc[0]
            width = 2**0.5 * table[f"{name}_half_width_g"].median()
            slope = abs(change) / fall if fall else np.nan
            rows.append([*life, name, change, width, 1e3 * width / slope if slope else np.inf])
    return pd.DataFrame(rows, columns=[*OF_A_LIFE, "measure", "change_g", "half_width_g", "detectable_mm"])
