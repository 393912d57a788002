"""Verdict of the draws of a posterior on each unknown, by a rule that was written before any fit.

Positions are those of the unit cube, over which the prior is even: its 90 % interval is 0.9 wide.

identified
    The 90 % interval is at most half as wide as the prior's, and neither bound is as likely as it was before: the outer
    twentieth of the range at either end holds less than a twentieth of the draws.
one-sided
    Not that, but an end of the range is excluded: the outer fifth there holds less than a tenth of what it held before,
    2 %.
not identified
    Neither.
in doubt
    Instead of the first two, where the records contradict the model: of some group of features the discrepancy's 90 %
    interval lies wholly above that of the prior. The interval is then one of a model that does not explain the records.
"""

from typing import NamedTuple

import numpy as np

IDENTIFIED, ONE_SIDED, NOT_IDENTIFIED, IN_DOUBT = "identified", "one-sided", "not identified", "in doubt"
NARROW = 0.5 * 0.9
EDGE, END, EXCLUDED = 0.05, 0.2, 0.02


class Verdict(NamedTuple):
    """A verdict in a word, and which ends of the range are excluded (``low``, ``high``, ``both`` or nothing)."""

    word: str
    excluded: str


def verdict(positions) -> Verdict:
    """The verdict on one unknown from (s,) draws of its position between 0 and 1."""
    u = np.asarray(positions)
    low, high = np.quantile(u, [0.05, 0.95])
    below, above = (u < END).mean() < EXCLUDED, (u > 1 - END).mean() < EXCLUDED
    excluded = "both" if below and above else "low" if below else "high" if above else ""
    if high - low <= NARROW and (u < EDGE).mean() < EDGE and (u > 1 - EDGE).mean() < EDGE:
        return Verdict(IDENTIFIED, excluded)
    return Verdict(ONE_SIDED if excluded else NOT_IDENTIFIED, excluded)
