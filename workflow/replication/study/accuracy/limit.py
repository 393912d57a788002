"""What a measure would be with a step of zero: extrapolated over steps, with its error."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from trackdyn.measure.convergence import Series, batch_error, paired


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
