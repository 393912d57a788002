"""Lives of many rigs: what came of them, from which first radius the contacts stay good longest, what a sensor sees."""

from collections.abc import Mapping, Sequence
from io import StringIO
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.settings import WearForm, WearPlan
from laboratory.wear.law import Coefficients, load_coefficients
from laboratory.wear.life import SENSED, Limits, Until, Worn, live
from trackdyn.measure.meshing import NEAR_LEAST, TOUCHING
from trackdyn.parameters.rig import Rig
from trackdyn.sources import module_hash
from trackdyn.sweeps.engine import results
from trackdyn.sweeps.store import key_of

OF_A_LIFE = ["rig", "rpm", "tension", "first_radius_m"]
STEP = 5e-5  # m of the ring's radius, between which states of a life are interpolated
NEARLY = 0.9  # of the longest run in the good window: what counts as right
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
        states = table.drop(columns=["depths", "rates", "next_m"])
        return {"rows": states.to_json(orient="records", double_precision=15), "flanks": flanks}

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
    requested, coefficients, sources = {}, load_coefficients().model_dump(), module_hash(__name__)
    for name, rig, own, plan in rigs:
        tensions = [own["tension"]] if "tension" in own else plan.tensions
        for rpm, tension, radius in product(plan.speeds_rpm, tensions, plan.first_radii_m):
            task = {
                "rig": rig.changed(sprocket__ring_radius=radius).model_dump(mode="json"), "rpm": rpm,
                "coefficients": coefficients, "fields": {"integrator": plan.integrator, "step": plan.step_s}
                | dict(own) | {"tension": tension}, "until": ["ring", form.until_radius_m], "factor": form.step_factor,
            }  # fmt: skip
            requested[key_of(sources, task)] = (name, rpm, tension, radius), task
    rows = results(lives_of, {key: task for key, (_, task) in requested.items()}, jobs, store, "wear", "life")
    found, flanks = [], {}
    for key, (life, _) in requested.items():
        values = rows[key]["values"]
        table = pd.DataFrame([{"distance_km": 0.0, "end": f"does not run new: {rows[key]['reason']}"}])
        if values:
            table, flanks[life] = pd.read_json(StringIO(values["rows"]), orient="records"), values["flanks"]
        share = table["distance_km"] / (table["distance_km"].iloc[-1] or 1.0)
        table = table.assign(life=share, cpu_s=rows[key]["cost"].get("cpu_s", np.nan))
        found.append(table.assign(**dict(zip(OF_A_LIFE, life, strict=True))))
    return pd.concat(found, ignore_index=True), flanks


def windows(lives: pd.DataFrame) -> pd.DataFrame:
    """Where along each life the contacts are good, by the radius of the ring.

    The window is that of C26: right arc free, left share within 2 points of the least that the rig shows at this speed
    with this tension. Shares are interpolated between the states of a life. A life passes all smaller radii on its way,
    so that what is left of it from a radius on is the life that begins there, as far as the state depends on the radius
    alone.

    Returns
    -------
    DataFrame
        A row a radius (``radius_m``, every `STEP`) of each life: ``good``, and ``good_km``, what the chain runs in the
        window from there on.
    """
    if "left_share_pct" not in lives:
        return pd.DataFrame(columns=[*OF_A_LIFE, "radius_m", "good", "good_km"])
    ran = lives.dropna(subset=["left_share_pct"])
    least = ran.groupby(OF_A_LIFE[:3])["left_share_pct"].min()
    found = []
    for life, table in ran.groupby(OF_A_LIFE, sort=False):
        falling = table.sort_values("ring_radius_m")
        known = falling["ring_radius_m"].to_numpy()
        ends = np.arange(np.ceil(known[0] / STEP), np.floor(known[-1] / STEP) + 1) * STEP
        left, right, run = (
            np.interp(ends, known, falling[name]) for name in ("left_share_pct", "right_share_pct", "distance_km")
        )
        good = (right < TOUCHING) & (left <= least[life[:3]] + NEAR_LEAST)
        between = good[1:] & good[:-1]
        good_km = np.concatenate([[0.0], np.cumsum(np.where(between, -np.diff(run), 0.0))])
        of_life = pd.DataFrame({"radius_m": ends, "good": good, "good_km": good_km})
        found.append(of_life.assign(**dict(zip(OF_A_LIFE, life, strict=True))))
    return pd.concat(found, ignore_index=True)[[*OF_A_LIFE, "radius_m", "good", "good_km"]]


def summarize(lives: pd.DataFrame, seen: pd.DataFrame) -> pd.DataFrame:
    """A row a life: kilometres, why it ended, and where the window of `windows` (``seen``) lies.

    ``good_from_m`` and ``good_to_m`` are the largest and the least radius in the window, ``good_km`` what the chain ran
    in it; ``right_begins_m`` is the largest radius of a state at which the right arc touches, ``left_leaves_m`` that at
    which the RMS force of the left arc is out of its band about that of the new ring.
    """
    rows = []
    window = dict(list(seen[seen["good"].astype(bool)].groupby(OF_A_LIFE)))
    for life, table in lives.groupby(OF_A_LIFE, sort=False):
        row = dict(zip(OF_A_LIFE, life, strict=True)) | {"end": table["end"].iloc[-1]}
        if "left_share_pct" in table and table["left_share_pct"].notna().all():
            touches = table["right_share_pct"] >= TOUCHING
            leaves = (table["left_rms_n"] / table["left_rms_n"].iloc[0] - 1.0).abs() > BAND
            good = window.get(life, seen.iloc[:0])
            row |= {
                "life_km": table["distance_km"].iloc[-1], "last_radius_m": table["ring_radius_m"].iloc[-1],
                "right_begins_m": table.loc[touches, "ring_radius_m"].max(),
                "left_leaves_m": table.loc[leaves, "ring_radius_m"].max(), "good_from_m": good["radius_m"].max(),
                "good_to_m": good["radius_m"].min(), "good_km": good["good_km"].max() if len(good) else 0.0,
                "left_depth_m": table["left_depth_m"].iloc[-1], "right_depth_m": table["right_depth_m"].iloc[-1],
                "cpu_s": table["cpu_s"].iloc[0],
            }  # fmt: skip
        rows.append(row)
    return pd.DataFrame(rows)


def wear_answer(summary: pd.DataFrame, seen: pd.DataFrame, printed: float = 0.308) -> str:
    """From which first radius the contacts stay good longest, and in how many rigs the printed one (m) does as well."""
    longest = seen.loc[seen.groupby(OF_A_LIFE[:3])["first_radius_m"].transform("max") == seen["first_radius_m"]]
    named, drawn = [], []  # best first radius, and how much of the longest run the printed one has
    for case, table in longest.groupby(OF_A_LIFE[:3], sort=False):
        if (most := table["good_km"].max()) > 0:
            best = table.loc[table["good_km"] >= most * (1 - 1e-9), "radius_m"].min()
            there = float(np.interp(printed, table["radius_m"], table["good_km"])) / most
            (drawn if case[0].startswith("drawn") else named).append((best, there))
    last = longest["radius_m"].max()
    message = ""
    if named:
        best, there = np.transpose(named)
        at_last = int((best > last - STEP / 2).sum())
        message = (
            f"Rigs with a name, {len(named)} cases of rig, speed and tension: the ring stays longest in the good "
            f"window from a first radius of {best.min():.5g} m or more, in {at_last} cases the largest one tried, "
            f"so that a larger one may be better; {printed:g} m has {there.min():.0%} to {there.max():.0%} of the "
            "longest run."
        )
    tried = summary[summary["rig"].str.startswith("drawn")]["rig"].nunique()
    if drawn:
        best, there = np.transpose(drawn)
        low, middle, high = np.quantile(best, [0.05, 0.5, 0.95])
        message += (
            f" Of {tried} drawn rigs {len(drawn)} have such a window; the best first radius is {middle:.5g} "
            f"m (median; 90% of them between {low:.5g} and {high:.5g}, with none tried above {last:.5g}), and "
            f"{printed:g} m has at least {NEARLY:.0%} of the longest run in {(there >= NEARLY).sum()}."
        )
    return message


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
