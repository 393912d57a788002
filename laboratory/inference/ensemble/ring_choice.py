"""Choosing the radius of the ring where the rig is not known: every radius with every rig of an ensemble."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from trackdyn.errors import InputError, shown
from trackdyn.measure.meshing import TOUCHING, serving_radius
from trackdyn.sweeps.table import read_table

# Columns of a study that are kept, and their names in a table of radii.
KEPT = {
    "left_share_pct": "left share, % of a turn", "left_rms_n": "left RMS, N", "left_peak_n": "left peak, N",
    "ring_rms_n": "ring RMS, N", "ring_peak_n": "ring peak, N", "sliding_teeth_j_km": "sliding on teeth, J/km",
    "sliding_ring_j_km": "sliding on ring, J/km",
}  # fmt: skip
STUDY_COLUMNS = ("rig", "rpm", "ring_radius_m", "right_share_pct", *KEPT)
SAME = 1e-9  # m
PASSING = "excluded_by"


class Criterion(NamedTuple):
    """What the best radius is, among those that leave the right arc free."""

    words: str
    column: str


CRITERIA = {
    "rule": Criterion(
        "the smallest radius whose left share is within 2 points of the least (the rule of C26)", "left_share_pct"
    ),
    "teeth": Criterion("least sliding work on the teeth", "sliding_teeth_j_km"),
    "sliding": Criterion("least sliding work on teeth and ring together", "sliding_j_km"),
    "force": Criterion("least RMS force of the left arc", "left_rms_n"),
}


def read_study(path: Path | str) -> pd.DataFrame:
    """A study of an ensemble with its columns as numbers."""
    rows = read_table(path)
    for name in STUDY_COLUMNS:
        if name not in rows.columns:
            raise InputError(f"{path}: has no column {name}; expected the table study.csv of an ensemble")
        numbers = pd.to_numeric(rows[name].replace("", None), errors="coerce")
        if (wrong := rows[name].notna() & (rows[name] != "") & numbers.isna()).any():
            raise InputError(f"{path}: {name} = {shown(rows.loc[wrong, name].iloc[0])}: must be a number")
        rows[name] = numbers
    return rows


def best_radius(rows: pd.DataFrame, criterion: str) -> float:
    """Best radius of one rig at one speed, m; NaN if no radius that leaves the right arc free meets the criterion.

    ``rows`` holds one a radius (`STUDY_COLUMNS`).
    """
    if criterion not in CRITERIA:
        raise InputError(f"criterion = {criterion!r}: choose {', '.join(CRITERIA)}")
    if criterion == "rule":
        by_radius = rows.set_index("ring_radius_m")
        return serving_radius(by_radius["left_share_pct"], by_radius["right_share_pct"])
    free = rows[rows["right_share_pct"] < TOUCHING].sort_values("ring_radius_m")
    if free.empty:
        return float("nan")
    value = (
        free["sliding_teeth_j_km"] + free["sliding_ring_j_km"]
        if criterion == "sliding"
        else free[CRITERIA[criterion].column]
    )
    return float(free.loc[value.idxmin(), "ring_radius_m"])


def whole_rigs(study: pd.DataFrame, rpm: float) -> pd.DataFrame:
    """Rows with a ring at one speed of the rigs that came out at every radius.

    Raises
    ------
    InputError
        A column is missing, nothing was run at that speed, or no rig is whole.
    """
    for name in STUDY_COLUMNS:
        if name not in study.columns:
            raise InputError(f"study: has no column {name}; expected the table of the stage study (study.csv)")
    rows = study[(study["rpm"] == rpm) & study["ring_radius_m"].notna()].dropna(subset=list(STUDY_COLUMNS))
    if rows.empty:
        speeds = ", ".join(f"{speed:g}" for speed in sorted(study["rpm"].unique()))
        raise InputError(f"study: holds no ring at {rpm:g} rpm; choose {speeds}")
    radii = rows["ring_radius_m"].nunique()
    complete = rows.groupby("rig")["ring_radius_m"].transform("nunique") == radii
    if not complete.any():
        raise InputError(f"study: no rig completed all {radii} radii at {rpm:g} rpm; use more rigs")
    return rows[complete]


def choice_table(study: pd.DataFrame, rpm: float) -> pd.DataFrame:
    """Every radius over the rigs.

    Returns
    -------
    DataFrame
        ``ring_radius_m, rigs``; ``passing``: no target excludes any of them; ``p_right_free``, if so with its exact
        95 % interval; median and 5 to 95 % of what ``KEPT`` names; ``p_best_<criterion>``: share of rigs in which the
        radius is the best one.
    """
    rows = whole_rigs(study, rpm)
    count = rows["rig"].nunique()
    best = {name: rows.groupby("rig")[list(STUDY_COLUMNS)].apply(best_radius, name) for name in CRITERIA}
    passing = PASSING in rows.columns and bool((rows[PASSING] == 0).all())
    found = []
    for radius, of in rows.groupby("ring_radius_m"):
        free = int((of["right_share_pct"] < TOUCHING).sum())
        interval = binomtest(free, count).proportion_ci(method="exact") if passing else None
        row = {"ring_radius_m": radius, "rigs": count, "passing": passing, "p_right_free": free / count}
        row |= {f"p_right_free_{end}": getattr(interval, end) if interval else np.nan for end in ("low", "high")}
        for column in KEPT:
            row |= dict(
                zip((f"{column}_q05", column, f"{column}_q95"), np.quantile(of[column], [0.05, 0.5, 0.95]), strict=True)
            )
        row |= {f"p_best_{name}": float((np.abs(radii - radius) < SAME).mean()) for name, radii in best.items()}
        found.append(row)
    return pd.DataFrame(found)


def recommendation(table: pd.DataFrame, criterion: str) -> str:
    """The radius that is best most often, in a sentence; an interval only if no target excludes any of the rigs."""
    if criterion not in CRITERIA:
        raise InputError(f"criterion = {criterion!r}: choose {', '.join(CRITERIA)}")
    chances, count = table[f"p_best_{criterion}"], int(table["rigs"].iloc[0])
    top = table.loc[chances.idxmax()]
    none = 1.0 - float(chances.sum())
    best = round(float(chances.max()) * count)
    within = ""
    if table["passing"].iloc[0]:
        interval = binomtest(best, count).proportion_ci(method="exact")
        within = f" (95 % interval {interval.low:.0%} to {interval.high:.0%})"
    rest = f"; in {round(none * count)} no radius is both free of the right arc and best" if none > SAME else ""
    return f"{top['ring_radius_m']:g} m is best in {best} of {count} rigs{within} by {CRITERIA[criterion].words}{rest}"


def study_table(runs: pd.DataFrame, excluded_by: pd.Series | None = None) -> pd.DataFrame:
    """Rows of the stage ``study`` that came out, with the columns that a choice needs; ``excluded_by``: how many
    targets exclude a rig.
    """
    done = runs[runs["state"] == "done"]
    table = done.assign(rig=done["name"].str.partition(" ")[0].astype(int)).reindex(columns=STUDY_COLUMNS)
    if excluded_by is not None:
        table[PASSING] = table["rig"].map(excluded_by)
    return table.reset_index(drop=True)
