"""What a measure would be with a step of zero: extrapolated over steps, with its error; how far presets are from it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.fidelity import PRESETS
from trackdyn.measure.whole_loop import RELATIVE, SHARES, Estimate
from trackdyn.study.accuracy.statistics import scale_of

LIMITS = ["scene", "measure", "limit", "limit_error", "finest", "finest_error", "finest_step_s"]
# what the preset `standard` shall keep in every measure: relative, or in turns of the sprocket
BOUND = 0.02
SURE = 2.0  # standard errors: the 95 % of a normal distribution


class Limit(NamedTuple):
    """A limit and its standard error."""

    value: float
    error: float


def limit_of(runs: Mapping[float, Estimate]) -> Limit:
    """The limit of a measure that converges in first order of the step.

    From the two finest steps (Richardson extrapolation, as for the order-1 methods of Roache, Journal of Fluids Engineering
    116, 1994, 405-413). Its error joins two: the sampling errors of both runs, and how far the next coarser pair of
    steps would extrapolate to, without which convergence is taken on trust; of two steps alone, the whole extrapolation.

    Parameters
    ----------
    runs : mapping of float to Estimate
        Of two steps (s) or more.
    """
    steps = sorted(runs)
    value, error = _extrapolated(*((step, runs[step]) for step in steps[:2]))
    other = _extrapolated(*((step, runs[step]) for step in steps[1:3]))[0] if len(steps) > 2 else runs[steps[0]].value
    return Limit(value, float(np.hypot(error, value - other)))


def _extrapolated(fine: tuple[float, Estimate], coarse: tuple[float, Estimate]) -> tuple[float, float]:
    """Straight line through two steps at a step of zero, and its standard error."""
    (h, a), (k, b) = fine, coarse
    lean = h / (k - h)
    return a.value + lean * (a.value - b.value), float(np.hypot((1 + lean) * a.error, lean * b.error))


def presets_beside_limits(rows: pd.DataFrame, limits: pd.DataFrame) -> pd.DataFrame:
    """Difference of every preset from the limit, with its standard error.

    Parameters
    ----------
    rows, limits : DataFrame
        Of `trade.statistic_trade`.

    Returns
    -------
    DataFrame
        A row a scene and measure: ``limit, limit_error`` (g, % of a turn, N); for each preset whose step was run
        ``<preset>_pct, <preset>_error_pct``: relative, shares in points of a turn; ``standard_within_bound``: yes and no
        if two standard errors do not change the answer, undecided otherwise.
    """
    full = rows[(rows["fidelity"] == "ten_arcs") & ~rows["failed"].astype(bool)]
    found = []
    for _, row in limits[limits["measure"].isin(RELATIVE + SHARES)].iterrows():
        scale = scale_of(row["measure"], row["limit"]) / 100
        line = {name: row[name] for name in ("scene", "measure", "limit", "limit_error")}
        for name, fields in PRESETS.items():
            here = full[(full["scene"] == row["scene"]) & (full["measure"] == row["measure"])]
            here = here[(here["integrator"] == fields["integrator"]) & np.isclose(here["step_s"], fields["step"], rtol=1e-9)]
            line |= {f"{name}_pct": np.nan, f"{name}_error_pct": np.nan}
            if len(here):
                run = here.iloc[0]
                line[f"{name}_pct"] = (run["value"] - row["limit"]) / scale
                line[f"{name}_error_pct"] = float(np.hypot(run["value_error"], row["limit_error"])) / abs(scale)
        line["standard_within_bound"] = _verdict(abs(line["standard_pct"]), SURE * line["standard_error_pct"], 100 * BOUND)
        found.append(line)
    return pd.DataFrame(found)


def _verdict(size: float, margin: float, bound: float) -> str:
    if not np.isfinite(size):
        return ""
    return "yes" if size + margin <= bound else "no" if size - margin > bound else "undecided"
