"""Extremes: every case completes with its invariants in bounds, or is refused in one sentence.

A case is a row of `COLUMNS`. The outcome is ``completed`` (all invariants in bounds), ``refused`` (an `InputError` or a
`DivergenceError` of one sentence), ``marked`` (completed, and reported as not resolved) or ``defect``: everything else,
with the cause in ``reason``. ``group`` and ``at`` are the curve of a measured ``value`` and its position on the axis.
"""

import warnings
from collections.abc import Callable

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import DivergenceError, InputError

COMPLETED, MARKED, REFUSED, DEFECT = "completed", "marked", "refused", "defect"
OUTCOMES = (COMPLETED, MARKED, REFUSED, DEFECT)
COLUMNS = [
    "family", "case", "outcome", "reason", "loop_gap_max_m", "energy_residual", "measure", "value", "expected",
    "bound", "group", "at",
]  # fmt: skip

GAP = 1.1e-10  # closure error of a rigid cut, m: the largest that the paper prints, fixed before the runs
# the tensioner is locked: one on its spring would leave out the methods and the motion in space that it does not have
FAST = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.1, "contact_log": False, "tension": "locked"}


def row(family: str, case: str, outcome: str, reason: str = "", **more) -> dict:
    """Return a row with every column: those of a ``case`` of a ``family`` with an ``outcome``, the others empty."""
    numbers = ("loop_gap_max_m", "energy_residual", "value", "expected", "bound", "at")
    about = {"family": family, "case": case, "outcome": outcome, "reason": reason}
    return dict.fromkeys(COLUMNS, "") | dict.fromkeys(numbers, np.nan) | about | more


def attempted(family: str, case: str, attempt: Callable[..., dict], *arguments) -> dict:
    """Return the row of ``attempt(*arguments)``: its columns, with ``reason`` if a bound is missed, or its error."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # numerical warnings are defects, too
            values = attempt(*arguments)
    except (InputError, DivergenceError) as error:
        if "\n" in str(error):
            return row(family, case, DEFECT, f"more than one sentence: {str(error).splitlines()[0]}")
        return row(family, case, REFUSED, str(error))
    except Exception as error:  # any other error is a defect
        return row(family, case, DEFECT, f"{type(error).__name__}: {''.join(str(error).splitlines()[:1])}")
    outcome = values.pop("outcome", DEFECT if values.get("reason") else COMPLETED)
    return row(family, case, outcome, **{name: value for name, value in values.items() if name in COLUMNS})


def within_bounds(value: float, expected: float, bound: float, measure: str, **more) -> dict:
    """Return columns of a measured number that must be within ``bound`` of the expected one."""
    missed = not abs(value - expected) <= bound  # a value that is not a number misses too
    reason = f"{measure} is {value:.4g}, not within {bound:.2g} of {expected:.4g}" if missed else ""
    return {"reason": reason, "measure": measure, "value": value, "expected": expected, "bound": bound, **more}


def below(value: float, bound: float, measure: str, **more) -> dict:
    """Return columns of a measured number that must not exceed ``bound``."""
    reason = "" if value <= bound else f"{measure} is {value:.3g}, more than {bound:.2g}"
    return {"reason": reason, "measure": measure, "value": value, "bound": bound, **more}


def extremes_summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return numbers of rows, completed, marked, refused and defects of each family, and of all."""
    counts = table.groupby("family", sort=False)["outcome"].value_counts().unstack(fill_value=0)
    counts = counts.reindex(columns=list(OUTCOMES), fill_value=0)
    counts.loc["all"] = counts.sum()
    counts.insert(0, "rows", counts.sum(axis=1))
    return counts.rename(columns={DEFECT: "defects"}).rename_axis("family").reset_index()
