"""What a rig must show: a printed number of a run, and how near is near enough."""

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np

from trackdyn.parameters.validation import Positive, Section

Rule = Literal["equal", "at_most", "at_least"]


class Case(NamedTuple):
    """A scene of a rig: motor speed (rev/min), ring radius (m; None: none), and whether forces are left out of it."""

    rpm: float
    ring: float | None
    belt: bool = False

    @property
    def name(self) -> str:
        """``115 none``, ``115 0.308``, ``150 belt``."""
        return f"{self.rpm:g} {'belt' if self.belt else 'none' if self.ring is None else format(self.ring, 'g')}"


class Target(Section):
    """A printed number that a rig must show.

    Attributes
    ----------
    claim : str
        Where it is printed (``config/claims.yaml``).
    output : str
        Number of a run that is compared with it.
    printed, tolerance : float
        In the unit of the output.
    rule : str
        ``equal``; ``at_most``, ``at_least``: on that side every value is right.
    """

    claim: str
    output: str
    printed: float
    tolerance: Positive
    rule: Rule = "equal"

    def departure(self, values) -> np.ndarray:
        """Values less the printed one, 0 where a one-sided target is met; NaN where a value is missing."""
        off = np.asarray(values) - self.printed
        return {"equal": off, "at_most": np.maximum(off, 0.0), "at_least": np.minimum(off, 0.0)}[self.rule]


def outside(row: Mapping[str, float], output: str) -> float | None:
    """Time that an arc spends in every area but one, % of a turn, for ``left_outside_2_pct``; None: another output."""
    side, found, area = output.removesuffix("_pct").partition("_outside_")
    if not found:
        return None
    return float(sum(row[f"{side}_area_{k}_pct"] for k in range(1, 11) if str(k) != area))


class CaseTarget(Target):
    """A target in a case of its own."""

    case: Case

    @property
    def name(self) -> str:
        """A name that no other target has."""
        return f"{self.claim} {self.output} {self.case.name}"

    @property
    def group(self) -> str:
        """The claim without its part."""
        return self.claim[:3]
