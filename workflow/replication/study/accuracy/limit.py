"""What a measure would be with a step of zero: extrapolated over steps, with its error; how far presets are from it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from replication.study.accuracy.statistics import scale_of
from trackdyn.measure.convergence import RELATIVE, SHARES, SURE, Series, batch_error, paired
from trackdyn.scene.fidelity import PRESETS, preset

LIMITS = ["scene", "measure", "limit", "limit_error", "finest", "finest_error", "finest_step_s"]
# what the preset `standard` shall keep in every measure: relative, or in turns of the sprocket
BOUND = 0.02


class Limit(NamedTuple):
    """A limit."""

    value: float  # the limit
    error: float  # its standard error, all in all
    doubt: float  # the share of the error that is convergence, not scatter
    values: np.ndarray  # (m,) what the limit is the mean of, passage by passage


def limit_of(runs: Mapping[float, Series], order: int = 1) -> Limit:
    """The limit of a measure that converges with a power of the step.

    From the two finest steps (Richardson extrapolation: Roache, Journal of Fluids Engineering 116, 1994, 405-413). Its
    error joins the scatter of passages of this combination of both runs, and how far the next coarser pair of steps
    would extrapolate to, without which convergence is taken on trust; of two steps alone, the whole extrapolation.
    """
    steps = sorted(runs)
    values = _extrapolated(runs, *steps[:2], order)
    other = _extrapolated(runs, *steps[1:3], order) if len(steps) > 2 else runs[steps[0]].linear()
    value, doubt = float(values.mean()), float(abs(values.mean() - other.mean()))
    return Limit(value, float(np.hypot(batch_error(values)[0], doubt)), doubt, values)


def _extrapolated(runs: Mapping[float, Series], fine: float, coarse: float, order: int) -> np.ndarray:
    """The line through two steps, over their power, at a step of zero, passage by passage."""
    lean = fine**order / (coarse**order - fine**order)
    near, far = paired(runs[fine].linear(), runs[coarse].linear())
    return near + lean * (near - far)


def difference(series: Series, limit: Limit) -> tuple[float, float]:
    """A measure less its limit, and the standard error of this difference."""
    one, other = paired(series.linear(), limit.values)
    return float(series.estimate().value - limit.value), float(np.hypot(batch_error(one - other)[0], limit.doubt))


def presets_beside_limits(rows: pd.DataFrame, limits: pd.DataFrame) -> pd.DataFrame:
    """Difference of every preset from the limit, with its standard error.

    Returns
    -------
    DataFrame
        A row a scene and measure: ``limit, limit_error`` (g, % of a turn, N); for each preset whose step was run
        ``<preset>_pct, <preset>_error_pct``: relative, shares in points of a turn; ``standard_within_bound``: yes and
        no if two standard errors do not change the answer, undecided otherwise.
    """
    full = rows[(rows["fidelity"] == "ten_arcs") & ~rows["failed"].astype(bool)]
    lines = []
    for _, row in limits[limits["measure"].isin(RELATIVE + SHARES)].iterrows():
        scale = scale_of(row["measure"], row["limit"]) / 100
        line = {name: row[name] for name in ("scene", "measure", "limit", "limit_error")}
        for name in PRESETS:
            fields = preset(name, not row["scene"].startswith("no ring"))
            here = full[(full["scene"] == row["scene"]) & (full["measure"] == row["measure"])]
            same_step = np.isclose(here["step_s"], fields["step"], rtol=1e-9)
            here = here[(here["integrator"] == fields["integrator"]) & same_step]
            off, error = np.nan, np.nan
            if len(here):
                run = here.iloc[0]
                off, error = (run["value"] - row["limit"]) / scale, 100 * run["uncertainty"]
            line |= {f"{name}_pct": off, f"{name}_error_pct": error}
        margin = SURE * line["standard_error_pct"]
        line["standard_within_bound"] = _verdict(abs(line["standard_pct"]), margin, 100 * BOUND)
        lines.append(line)
    return pd.DataFrame(lines)


def _verdict(size: float, margin: float, bound: float) -> str:
    if not np.isfinite(size):
        return ""
    return "yes" if size + margin <= bound else "no" if size - margin > bound else "undecided"
