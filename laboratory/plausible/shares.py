"""Shares of rigs that show a sentence, and which values part those that do from those that do not."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.stats import binomtest, spearmanr

from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import PlausibleConfig
from trackdyn.sweeps.engine import DONE

FOLLOWS, DEPENDS, NEVER, NOT_JUDGED = "follows", "depends", "never", "not judged"
LEVEL = 0.9  # probability of the intervals
CHANCE = 0.01  # a rank correlation that chance reaches as often, over all values together, separates nothing
SEPARATING = 2  # values that are named


def shares(config: PlausibleConfig, judged: pd.DataFrame, statements: Mapping[str, str]) -> pd.DataFrame:
    """Share of rigs that show a sentence or a claim, by scenario, with its 90 % interval (Clopper and Pearson).

    Parameters
    ----------
    config : PlausibleConfig
        Scenarios, and the share from which on a sentence follows from the model.
    judged : DataFrame
        `verdicts.judge_rows`.
    statements : mapping
        Columns of ``judged`` (numbers of sentences, names of claims) and their words.

    Returns
    -------
    DataFrame
        ``name, statement, ring, equal_pitch, rigs, shown, share, low, high, class``; the class is that of all scenarios
        together: ``follows`` where each has at least the configured share, ``never`` where no rig shows it, else
        ``depends``.
    """
    rows = []
    for name, statement in statements.items():
        scenarios = []
        for scenario in config.scenarios:
            in_scenario = (judged["ring"] == scenario.ring) & (judged["equal_pitch"] == scenario.equal_pitch)
            shown = judged.loc[in_scenario, name].dropna() if name in judged else pd.Series(dtype=float)
            row = {"name": name, "statement": statement, **scenario._asdict(), "rigs": len(shown)}
            if len(shown):
                interval = binomtest(int(shown.sum()), len(shown)).proportion_ci(LEVEL)
                row |= {"shown": int(shown.sum()), "share": shown.mean(), "low": interval.low, "high": interval.high}
            scenarios.append(row)
        parts = [row.get("share", np.nan) for row in scenarios]
        if np.isnan(parts).all():
            kind = NOT_JUDGED
        else:
            kind = FOLLOWS if np.nanmin(parts) >= config.follows else NEVER if np.nanmax(parts) == 0 else DEPENDS
        rows += [row | {"class": kind} for row in scenarios]
    columns = ["name", "statement", "ring", "equal_pitch", "rigs", "shown", "share", "low", "high", "class"]
    return pd.DataFrame(rows, columns=columns)


def separating_values(judged: pd.DataFrame, names: Iterable[str], values: Sequence[str]) -> pd.DataFrame:
    """Those of the ``values`` whose ranks correlate most with showing a sentence or claim, within the scenarios.

    ``names`` are the columns of ``judged`` (`verdicts.judge_rows`) that hold the verdicts.

    Returns
    -------
    DataFrame
        ``name, value, correlation, median_shown, median_not``, at most two rows a name, the larger correlation first;
        correlations that chance alone reaches are left out.
    """
    rows = []
    for name in names:
        rigs = judged.dropna(subset=name) if name in judged else judged[:0]
        if rigs[name].nunique() < 2 if name in rigs else True:
            continue
        # ranks within a scenario: what a scenario changes is no value of a rig
        groups = rigs.groupby(["ring", "equal_pitch"])
        centred = rigs[name] - groups[name].transform("mean")
        drawn = [value for value in values if rigs[value].nunique() > len(groups)]
        results = [spearmanr(groups[value].rank(pct=True), centred) for value in drawn]
        ordered = sorted(zip(results, drawn, strict=True), key=lambda result: -abs(result[0].statistic))
        medians = rigs.groupby(name)[drawn].median()
        rows += [
            [name, value, result.statistic, medians.at[1.0, value], medians.at[0.0, value]]
            for result, value in ordered[:SEPARATING]
            if result.pvalue * len(drawn) < CHANCE
        ]
    return pd.DataFrame(rows, columns=["name", "value", "correlation", "median_shown", "median_not"])


def tooth_detail(
    rows: Sequence[tuple[int, dict]], speeds: Sequence[float], rings: Sequence[float | None]
) -> pd.DataFrame:
    """Change of the RMS of the acceleration by three surfaces in place of ten arcs.

    Parameters
    ----------
    rows : sequence of (draw, values)
        Values of a rig's row (`rows.run_rig`) by profile: ``ten_arcs``, ``three_surfaces``.
    speeds, rings : sequence
        Motor speeds, rev/min; ring radii, m.

    Returns
    -------
    DataFrame
        ``draw, ring_radius_m, rpm, ten_arcs_g, three_surfaces_g, change_pct``.
    """
    table = []
    for draw, values in rows:
        for ring in rings:
            for rpm in speeds:
                ten, three = (values[name][scene_name(rpm, ring)]["rms_g"] for name in ("ten_arcs", "three_surfaces"))
                table.append([draw, ring, rpm, ten, three, 100 * (three / ten - 1)])
    columns = ["draw", "ring_radius_m", "rpm", "ten_arcs_g", "three_surfaces_g", "change_pct"]
    return pd.DataFrame(table, columns=columns)


def outcomes(judged: pd.DataFrame) -> pd.DataFrame:
    """Count drawn rigs by scenario: ``ring, equal_pitch, draws, ran`` and how many were refused for which reason."""
    reasons = judged["reason"].where(judged["state"] != DONE, "ran").fillna("").str.split(":").str[0]
    reasons = reasons.str.replace(r"[\d.e+-]+", "…", regex=True)
    table = judged.assign(reason=reasons).groupby(["ring", "equal_pitch", "reason"]).size().rename("rigs")
    return table.reset_index()
