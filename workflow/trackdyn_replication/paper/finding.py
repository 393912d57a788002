"""Verdicts by the tangential force of the ring on tracks that mesh as printed (``data/plausible/grip.csv``)."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import pandas as pd
import scipy  # `scipy.stats` is loaded at first use: it takes a second

from trackdyn.measure.columns import listed

TABLE = "data/plausible/grip.csv"
LAW = ["law", "transition_velocity", "friction_static", "shear_stiffness"]
OWN = {"regularised": "transition_velocity", "dahl": "shear_stiffness"}  # the value that a law is varied by
VERDICTS = ("conclusion_3", "plateau")
LEVEL = 0.9  # probability of the intervals
FRICTION = 0.3  # static coefficient that the laws share
# edges of bins of the mobilised friction, a factor of two apart
BINS = 0.3 * 2.0 ** np.arange(-8, 1)


def ran(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the study that ran, all starts and integrators."""
    return table[table["state"] == "done"].reset_index(drop=True)


def main_run(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the first start in the integrator that ran on all tracks."""
    first = table[table["start"] == 1]
    return first[first["integrator"] == first["integrator"].mode()[0]]


def shares(table: pd.DataFrame) -> pd.DataFrame:
    """Count the tracks on which each verdict holds, by law, setting and speed, with 90 % Clopper-Pearson intervals."""
    rows = []
    for (*setting, rpm), verdicts in main_run(table).groupby([*LAW, "rpm"], dropna=False):
        row = dict(zip(LAW, setting, strict=True)) | {"rpm": rpm, "tracks": len(verdicts)}
        for name in VERDICTS:
            count = int(verdicts[name].sum())
            interval = scipy.stats.binomtest(count, len(verdicts)).proportion_ci(LEVEL)
            row |= {name: count, f"{name}_share": count / len(verdicts)}
            row |= {f"{name}_low": interval.low, f"{name}_high": interval.high}
        rows.append(row)
    return pd.DataFrame(rows)


def of_law(counts: pd.DataFrame, law: str, rpm: float) -> pd.DataFrame:
    """Return the shares of a law at a speed with the common friction, by its value; values run on most tracks only."""
    chosen = counts[(counts["law"] == law) & (counts["friction_static"] == FRICTION) & (counts["rpm"] == rpm)]
    return chosen[chosen["tracks"] == chosen["tracks"].max()].sort_values(OWN[law]).set_index(OWN[law])


def windows(table: pd.DataFrame) -> pd.DataFrame:
    """Return radii less the polygon radius (m) at which an arc lets go or comes back, by bins of mobilised friction."""
    run, rows = main_run(table), []
    for low, high in pairwise(BINS):
        inside = run[run["mobilised_friction"].between(low, high, inclusive="left")]
        for event in ("right_free_from_m", "right_back_from_m", "left_lost_from_m"):
            if len(inside) >= 10:
                above = (inside[event] - inside["polygon_m"]).fillna(np.inf)  # none: beyond the largest ring
                quantiles = np.quantile(above, [0.1, 0.5, 0.9], method="inverted_cdf")
                rows.append([low, high, event, len(inside), *quantiles])
    return pd.DataFrame(rows, columns=["low", "high", "event", "rows", "q10", "q50", "q90"])


def open_runs(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the main run whose track shows conclusion 3 with at least one law at their speed."""
    run = main_run(table).dropna(subset="mobilised_friction")
    return run[run.groupby(["draw", "rpm"])["conclusion_3"].transform("max") == 1]


def limit(table: pd.DataFrame) -> float:
    """Return the mobilised friction below which conclusion 3 holds and above which it does not, with fewest errors."""
    run = open_runs(table).sort_values("mobilised_friction")
    holds = run["conclusion_3"].to_numpy()
    wrong = np.r_[0, np.cumsum(1 - holds)] + np.r_[np.cumsum(holds[::-1])[::-1], 0]  # limit before each row, and behind
    place = int(wrong.argmin())
    values = run["mobilised_friction"].to_numpy()
    return float(np.sqrt(values[place - 1] * values[place])) if 0 < place < len(values) else float(values[0])


def _listed(numbers: Iterable[float]) -> str:
    """Word numbers in their order: ``0, 2 and 8``."""
    return listed([f"{number:g}" for number in numbers])


def finding_sentences(table: pd.DataFrame, brief: bool = False) -> list[str]:
    """Word the finding by both laws and the friction that parts the tracks; not ``brief``, also other speeds."""
    counts, at_others = shares(table), []
    rpm, *others = counts.groupby("rpm")["tracks"].max().sort_values(ascending=False, kind="stable").index
    eq10, dahl = (of_law(counts, law, rpm) for law in OWN)
    tracks = int(dahl["tracks"].max())
    finding = (
        "**The tangential force of the ring decides conclusion 3 of the paper**: with rings from 0.305 m on, the right "
        "arc of a connector, on the trailing flank, touches no tooth."
    )
    if brief:
        (first, last), (soft, stiff) = (rows["conclusion_3"].iloc[[0, -1]] for rows in (eq10, dahl))
        (slow, fast), (low, high) = 1e3 * eq10.index[[0, -1]], 1e-3 * dahl.index[[0, -1]]
        by_law = (
            f"With Eq. 10 it holds at {rpm:g} rpm on {first:g} to {last:g} of {tracks} tracks that mesh as printed, "
            f"for a transition velocity of {slow:g} to {fast:g} mm/s; with Dahl's law, which has no velocity, on "
            f"{soft:g} to {stiff:g}, for a shear stiffness of {low:g} to {high:g} kN/m a link. Nothing else differs."
        )
        return [finding, by_law, _limit_sentence(table)]
    for other in others:
        both = [of_law(counts, law, other) for law in OWN]
        words = " and on ".join(_listed(rows["conclusion_3"]) for rows in both if len(rows))
        at_others.append(f"At {other:g} rpm, run on {max(rows['tracks'].max() for rows in both):.0f} of them: {words}.")
    return [
        finding,
        f"With Eq. 10 it holds at {rpm:g} rpm on {_listed(eq10['conclusion_3'])} of {tracks} tracks that mesh as "
        f"printed, for a transition velocity of {_listed(1e3 * eq10.index)} mm/s.",
        f"With Dahl's law, which has no velocity, it holds on {_listed(dahl['conclusion_3'])}, for a shear stiffness "
        f"of {_listed(1e-3 * dahl.index)} kN/m a link. Nothing else differs; the friction coefficient is {FRICTION:g}.",
        *at_others,
        _limit_sentence(table),
        f"The plateau of the left arc (sentence 21) comes and goes with it: on {_listed(eq10['plateau'])} and on "
        f"{_listed(dahl['plateau'])} of the tracks.",
    ]


def _limit_sentence(table: pd.DataFrame) -> str:
    """Word the mobilised friction that separates the tracks."""
    edge, known = limit(table), open_runs(table)
    right = ((known["mobilised_friction"] < edge) == (known["conclusion_3"] == 1)).mean()
    return (
        "Where a track can show it, it does with either law if the tangential force of the ring stays below "
        f"{edge:.2g} of its normal force, and not above, in {100 * right:.0f} % of the runs."
    )


def check_sentences(table: pd.DataFrame) -> list[str]:
    """Word the limits of friction, and how far other steps and another start move the verdict."""
    run, counts, sentences = main_run(table), shares(table), []
    whole = counts[counts["tracks"] == counts["tracks"].max()]
    for _, free in whole[whole["law"] == "none"].iterrows():
        best = whole.loc[whole["conclusion_3"].idxmax()]
        sentences.append(
            f"Without friction on the ring conclusion 3 holds on {free['conclusion_3']:.0f} of {free['tracks']:.0f} "
            f"tracks, and with no law on more than {best['conclusion_3']:.0f}: elsewhere the tooth's geometry decides."
        )
    first, method = table["start"] == 1, run["integrator"].iloc[0]
    for words, others in (
        ("by the explicit method in smaller steps", table[first & (table["integrator"] != method)]),
        ("from another start of the motor with a longer wait", table[~first]),
    ):
        pairs = others.merge(run, on=["draw", "rpm", *LAW], suffixes=("", "_main"))
        if len(pairs):
            same = (pairs["conclusion_3"] == pairs["conclusion_3_main"]).sum()
            sentences.append(f"Run again {words}, {same} of {len(pairs)} verdicts on it are the same.")
    return sentences
