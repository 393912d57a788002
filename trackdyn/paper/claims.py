"""Every claim of the paper judged by what the runs gave."""

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from trackdyn.errors import InputError
from trackdyn.paper.evidence import BOUND_IS_OURS, MEASURES, Evidence
from trackdyn.parameters.validation import Section, read_yaml, validated

REPRODUCED = "reproduced"
IN_TREND = "in trend"
NOT_REPRODUCED = "not reproduced"
NOT_COMPARABLE = "not comparable"
VERDICTS = (REPRODUCED, IN_TREND, NOT_REPRODUCED, NOT_COMPARABLE)
COLUMNS = ("id", "place", "claim", "printed", "measured", "unit", "tolerance", "verdict", "reason")


class Claim(Section):
    """One row of ``config/claims.yaml``.

    ``rule``: ``equal`` within ``tolerance`` of ``printed`` (lists: each), ``at_most``, ``at_least``,
    ``true``, ``same`` (text), or ``not_comparable``. ``trend_tolerance`` is the wider one within which
    a value still counts as the trend; with ``rising_is_trend`` so do values that rise one after another.
    ``reason`` is the tolerance's, ``otherwise`` what is known about why a claim may not come out.
    """

    id: Annotated[str, Field(pattern=r"^C\d\d$")]
    place: str
    claim: str
    printed: Any = None
    unit: str = "1"
    measure: str | None = None
    rule: Literal["equal", "at_most", "at_least", "true", "same", "not_comparable"]
    tolerance: float | list[float] | None = None
    trend_tolerance: float | list[float] | None = None
    rising_is_trend: bool = False
    reason: Annotated[str, Field(min_length=10)]
    otherwise: str = ""

    @model_validator(mode="after")
    def _complete(self):
        if self.rule == "not_comparable":
            return self
        if self.measure not in MEASURES:
            raise InputError(
                f"claim {self.id}: measure = {self.measure!r} is unknown; known are {', '.join(sorted(MEASURES))}"
            )
        if self.rule == "equal" and self.tolerance is None:
            raise InputError(f"claim {self.id}: tolerance is missing; the rule equal needs one, with its reason")
        return self


class Claims(Section):
    claims: Annotated[list[Claim], Field(min_length=1)]

    @model_validator(mode="after")
    def _unique(self):
        seen = [claim.id for claim in self.claims]
        for name in seen:
            if seen.count(name) > 1:
                raise InputError(f"claim {name} stands twice; give every claim its own id")
        return self


def load_claims(path: Path | str) -> list[Claim]:
    """Read and validate the claims.

    Raises
    ------
    InputError
        One sentence: unknown measure, tolerance without a reason, an id that stands twice.
    """
    return validated(Claims, read_yaml(path), str(path), missing="every claim needs it").claims


def _near(measured, printed, tolerance) -> bool:
    measured, printed = np.atleast_1d(np.asarray(measured, float)), np.atleast_1d(np.asarray(printed, float))
    if measured.shape != printed.shape and printed.size == 1:
        printed = np.full(measured.shape, printed[0])
    if measured.shape != printed.shape or not np.isfinite(measured).all():
        return False
    return bool(np.all(np.abs(measured - printed) <= np.asarray(tolerance, float)))


def judge(claim: Claim, evidence: Evidence) -> tuple[Any, str]:
    """What a claim's measure came out as, and the verdict."""
    if claim.rule == "not_comparable":
        return (None if claim.measure is None else MEASURES[claim.measure](evidence)), NOT_COMPARABLE
    measured = MEASURES[claim.measure](evidence)
    if measured is None:  # what it needs is not there
        return None, NOT_COMPARABLE
    if claim.rule == "true":
        return measured, REPRODUCED if measured else NOT_REPRODUCED
    if claim.rule == "same":
        return measured, REPRODUCED if measured == claim.printed else NOT_REPRODUCED
    if claim.rule in ("at_most", "at_least"):
        values, bounds = (
            np.atleast_1d(np.asarray(measured, float)),
            np.atleast_1d(np.asarray(claim.printed, float)),
        )
        good = values <= bounds if claim.rule == "at_most" else values >= bounds
        return measured, REPRODUCED if bool(np.all(good)) else NOT_REPRODUCED
    if _near(measured, claim.printed, claim.tolerance):
        return measured, REPRODUCED
    wide = claim.trend_tolerance is not None and _near(measured, claim.printed, claim.trend_tolerance)
    ordered = claim.rising_is_trend and bool(np.all(np.diff(np.asarray(measured, float)) >= 0))
    return measured, IN_TREND if wide or ordered else NOT_REPRODUCED


def _text(value) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def printed_text(claim: Claim) -> str:
    """What the paper has to compare with: a number, a bound that we read into its words, or only words.

    Empty if the claim is not judged and nothing is printed.
    """
    if claim.rule == "true":
        return "in words"
    text = _text(claim.printed)
    if claim.measure in BOUND_IS_OURS and claim.rule in ("at_most", "at_least"):
        return f"bound {claim.rule.replace('_', ' ')} {text}"
    return text


def judge_all(claims: list[Claim], evidence: Evidence) -> pd.DataFrame:
    """The scorecard: one row a claim, columns ``COLUMNS``."""
    rows = []
    for claim in claims:
        measured, verdict = judge(claim, evidence)
        rows.append(
            {
                "id": claim.id,
                "place": claim.place,
                "claim": claim.claim,
                "printed": printed_text(claim),
                "measured": _text(measured),
                "unit": claim.unit,
                "tolerance": _text(claim.tolerance),
                "verdict": verdict,
                "reason": claim.reason
                if verdict in (REPRODUCED, NOT_COMPARABLE)
                else " ".join([claim.reason, claim.otherwise]).strip(),
            }
        )
    return pd.DataFrame(rows, columns=list(COLUMNS))
