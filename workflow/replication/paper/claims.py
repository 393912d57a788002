"""Every claim of the paper judged by what the runs of a rig gave."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from replication.paper.evidence import Evidence
from replication.paper.measures import MEASURES, NotThere, Range
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import NotNegative, Positive, Section, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.measure.columns import TABLES, error_of

REPRODUCED, NOT_REPRODUCED, NO_TEST, NOT_COMPARABLE = "reproduced", "not reproduced", "no test", "not comparable"
JUDGED = (REPRODUCED, NOT_REPRODUCED)
VERDICTS = (*JUDGED, NO_TEST, NOT_COMPARABLE)
ONE_SIDED = ("at_most", "at_least")
SLACK = 1 + 1e-9  # on a tolerance: 0.309 - 0.308 is more than 0.001 in binary
COLUMNS, VALUE_COLUMNS = (tuple(TABLES[name][1]) for name in ("claims", "claims_values"))


class Claim(Section):
    """One row of ``config/claims.yaml``, whose head explains the fields.

    ``sentence`` is the number of the paper's sentence that the claim belongs to; one without is not counted.
    ``printed`` by motor speed stands for the numbers at the speeds that are judged. A direction holds within the share
    ``within``. Of a quantity with ``any_reading`` one reading that is met suffices, at every speed. ``numbers`` says
    how many printed or implied numbers it holds (`printed_numbers`). ``scale`` is what counts as one tolerance in the
    distance of a one-sided claim (`Value`); no verdict depends on it.
    """

    id: Annotated[str, Field(pattern=r"^C\d\d$")]
    part: Annotated[str, Field(pattern=r"^[a-z]?$")] = ""
    sentence: int | None = None
    place: str
    claim: str
    printed: Any = None
    ours: bool = False
    unit: str = "1"
    measure: str | None = None
    rule: Literal["equal", "at_most", "at_least", "rising", "same", "no_test", "not_comparable"]
    tolerance: float | None = None
    within: NotNegative = 0.0
    any_reading: bool = False
    numbers: Annotated[int, Field(ge=0)] = 0
    scale: Positive | None = None
    fails_if: str = ""
    reason: Annotated[str, Field(min_length=10)]
    otherwise: str = ""

    @property
    def name(self) -> str:
        """``C16b``."""
        return self.id + self.part

    @model_validator(mode="after")
    def _complete(self):
        if self.rule == "not_comparable":
            return self
        if self.measure not in MEASURES:
            near = get_close_matches(self.measure or "", MEASURES, 1)
            meant = f"; did you mean {near[0]!r}?" if near else "; workflow/replication/paper/measures.py has them all"
            raise InputError(f"claim {self.name}: measure = {self.measure!r} is not a measure{meant}")
        if self.rule == "equal" and self.tolerance is None:
            raise InputError(f"claim {self.name}: tolerance is missing; the rule equal needs one, with its reason")
        if self.scale is not None and self.rule not in ONE_SIDED:
            raise InputError(f"claim {self.name}: scale belongs to {', '.join(ONE_SIDED)}; {self.rule} has none")
        if not self.fails_if:
            raise InputError(f"claim {self.name}: fails_if is missing; say what would have failed the claim")
        return self


class Claims(Section):
    sentences: dict[int, str]
    claims: Annotated[list[Claim], Field(min_length=1)]

    @model_validator(mode="after")
    def _complete(self):
        numbers = {claim.sentence for claim in self.claims} - {None}
        for number in sorted(numbers ^ set(self.sentences)):
            missing = "is not among the sentences" if number in numbers else "has no claim"
            raise InputError(f"sentence {number} {missing}; every sentence needs a claim, and every number a sentence")
        names = [claim.name for claim in self.claims]
        if twice := [name for name in names if names.count(name) > 1]:
            remedy = "give every claim its own id, every statement its own letter"
            raise InputError(f"claim {twice[0]} occurs twice; {remedy}")
        return self


def load_claims(path: Path | str) -> list[Claim]:
    """Read and validate the claims; `InputError` for an unknown measure, or an id that occurs twice."""
    return validated(Claims, read_yaml(path), str(path), missing="every claim needs it").claims


def load_sentences(path: Path | str) -> dict[int, str]:
    """Sentences of the paper by their numbers, in its order; `InputError` as `load_claims`."""
    return validated(Claims, read_yaml(path), str(path), missing="every claim needs it").sentences


class Value(NamedTuple):
    """One number that a claim is judged by."""

    rpm: float  # motor speed, rev/min; NaN for a number that belongs to all speeds
    reading: str  # which of several at a speed: a reading of the paper's words, ``least``, ``largest``, a count from 1
    value: float
    printed: float  # the value it is compared with; NaN for a trend
    # From what is printed in tolerances: at most 1 is met. A one-sided claim is at 1 on its bound (`Claim.within`
    # beyond what is printed), one `Claim.scale` beyond it at 2, one or more on the good side of it at 0. Infinite for
    # what never happens; NaN where there is no distance: a trend, a one-sided claim without a scale, no test
    distance: float
    met: bool | None  # whether it is as claimed; None where nothing is tested


class Judgement(NamedTuple):
    """Result of judging a claim."""

    measured: str  # the measured value as text, or why there is none
    verdict: str
    speeds: list[float]  # at which it was judged, rev/min
    values: tuple[Value, ...] = ()  # basis of the verdict: none for text, and for a claim that is not comparable


def _named(claim: Claim, measured, speeds) -> list[tuple[float, str, float]]:
    """Speed, reading and number of everything that was measured, in the order of the array that it makes."""
    if isinstance(measured, str) or measured is None:
        return []
    many = isinstance(measured, list | tuple) and not isinstance(measured, Range)
    items = list(measured) if many else [measured]
    by_speed = MEASURES[claim.measure].by_speed and len(items) == len(speeds)
    numbers = []
    for i, item in enumerate(items):
        rpm = speeds[i] if by_speed else speeds[0] if len(speeds) == 1 else float("nan")
        count = "" if by_speed or len(items) == 1 else str(i + 1)
        parts = (("least", item.low), ("largest", item.high)) if isinstance(item, Range) else (("", item),)
        numbers += [(rpm, " ".join(filter(None, (count, name))), float(number)) for name, number in parts]
    return numbers


def _values(claim: Claim, measured, speeds) -> tuple[Value, ...]:
    """The numbers of a measure, each with its own distance and test."""
    if not (named := _named(claim, measured, speeds)):
        return ()
    numbers = np.array([number for _, _, number in named])
    one_sided = claim.rule in ONE_SIDED
    printed = np.full(len(numbers), np.nan)
    away, met = printed.copy(), [None] * len(numbers)
    compared = one_sided or claim.rule == "equal"
    if compared or (claim.rule == "no_test" and claim.printed is not None):
        printed_values = [claim.printed[rpm] for rpm in speeds] if isinstance(claim.printed, dict) else claim.printed
        bounds, shape = np.asarray(printed_values, dtype=float), np.shape(measured)
        if bounds.ndim < len(shape):  # a bound for both ends of a range
            bounds = bounds[..., None]
        printed = np.broadcast_to(bounds, shape).ravel()
    if compared:
        difference = numbers - printed
        side = -difference if claim.rule == "at_least" else difference if one_sided else np.abs(difference)
        leeway = claim.within * np.abs(printed) if one_sided else SLACK * claim.tolerance
        met = list((side <= leeway) & np.isfinite(numbers))
        if not one_sided or claim.scale:
            away = np.maximum(0.0, 1 + (side - leeway) / claim.scale) if one_sided else side / claim.tolerance
            away = np.where(np.isfinite(difference), away, np.inf)
    elif claim.rule == "rising":
        met = list(np.isfinite(numbers) & np.r_[True, numbers[1:] > (1 - claim.within) * numbers[:-1]])
    if (
        compared and claim.any_reading and measured and isinstance(measured[0], Range)
    ):  # any value within a range is a reading
        low, high = numbers.reshape(-1, 2).T
        inside = np.repeat((low <= printed[::2]) & (printed[::2] <= high), 2)
        away, met = np.where(inside, 0.0, away), list(inside | met)
    rows = zip(named, printed, away, met, strict=True)
    return tuple(
        Value(*name, float(bound), float(far), None if good is None else bool(good)) for name, bound, far, good in rows
    )


def judge(claim: Claim, e: Evidence) -> Judgement:
    """Judge a claim by the evidence of a rig; one whose evidence is not there (`NotThere`) is not comparable."""
    if claim.rule == "not_comparable":
        return Judgement("", NOT_COMPARABLE, list(claim.printed) if isinstance(claim.printed, dict) else [])
    speeds = e.speeds(MEASURES[claim.measure].table)
    speeds = [rpm for rpm in speeds if not isinstance(claim.printed, dict) or rpm in claim.printed]
    try:
        if not speeds:
            raise NotThere("not run")
        if claim.rule == "rising" and len(speeds) < 2:
            raise NotThere("one speed alone")
        measured = MEASURES[claim.measure].evaluate(e, speeds)
        run, *events = MEASURES[claim.measure].events or ("",)
        scatter = dict(zip(events, e.event_times(run, events, "sd_s"), strict=True))
        # at the mean of events whose times scatter by more nothing may happen
        wide = [name for name in events if claim.tolerance is not None and scatter[name] > SLACK * claim.tolerance]
        if wide and claim.any_reading:
            measured = [value for k, value in enumerate(measured) if k >= len(events) or events[k] not in wide]
        if wide and not (claim.any_reading and measured):
            reason = f"{wide[0]}: passages scatter by {scatter[wide[0]]:.2g} {claim.unit}, more than the tolerance"
            raise NotThere(reason)
    except NotThere as missing:
        return Judgement(str(missing), NOT_COMPARABLE, speeds)
    values = _values(claim, measured, speeds)
    if claim.rule == "no_test":
        verdict = NO_TEST
    elif claim.rule == "same":
        verdict = REPRODUCED if measured == claim.printed else NOT_REPRODUCED
    else:
        verdict = REPRODUCED if values and all(_met(claim, values).values()) else NOT_REPRODUCED
    return Judgement(_text(measured), verdict, speeds, values)


def _met(claim: Claim, values: Iterable[Value]) -> dict[tuple[float, str], bool]:
    """Whether the numbers of a claim are met, by speed and name; with `Claim.any_reading` by speed alone."""
    met: dict[tuple[float, str], bool] = {}
    for value in values:
        name = value.rpm, "" if claim.any_reading else value.reading
        met[name] = met.get(name, False) or bool(value.met)
    return met


NO_VALUE = "no value"  # such as a ratio of forces that never act


def _text(value) -> str:
    if value is None:
        return ""
    if isinstance(value, Range | float) and np.isnan(value).any():
        return NO_VALUE
    if isinstance(value, Range):
        return f"{_text(value.low)} to {_text(value.high)}"
    if isinstance(value, list | tuple):
        return ("; " if any(isinstance(item, Range) for item in value) else ", ").join(map(_text, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def printed_text(claim: Claim, speeds=()) -> str:
    """Text of the value to compare with: a printed number, a bound that we read into the paper's words, or only words.

    Empty if the claim is not judged and nothing is printed.
    """
    if claim.rule == "rising":
        return "in words"
    value = claim.printed
    text = _text([value[rpm] for rpm in speeds]) if isinstance(value, dict) else _text(value)
    return f"ours: {claim.rule.replace('_', ' ')} {text}" if claim.ours else text


def _row(rig: str, claim: Claim, judgement: Judgement) -> dict:
    measured, verdict, speeds, _ = judgement
    reasons = [claim.reason] if verdict in (REPRODUCED, NOT_COMPARABLE) else [claim.reason, claim.otherwise]
    return {
        **claim.model_dump(include={"id", "part", "sentence", "place", "claim", "unit", "fails_if"}),
        "rig": rig,
        "printed": printed_text(claim, speeds),
        "measured": measured,
        "tolerance": _text(claim.tolerance),
        "verdict": verdict,
        "speeds": ", ".join(f"{rpm:g}" for rpm in speeds),
        "by_speed": verdict != NOT_COMPARABLE and MEASURES[claim.measure].by_speed,
        "reason": " ".join(filter(None, reasons)),
    }


def judge_all(claims: list[Claim], e: Evidence, rig: str = "") -> tuple[pd.DataFrame, pd.DataFrame]:
    """The scorecard of a rig of this name, and its numbers.

    Returns
    -------
    card : DataFrame
        A row for every statement, columns ``COLUMNS``.
    values : DataFrame
        A row for every number that a verdict is made from, columns ``VALUE_COLUMNS``.
    """
    card, values = [], []
    for claim in claims:
        judgement = judge(claim, e)
        card.append(_row(rig, claim, judgement))
        column = claim.measure and MEASURES[claim.measure].column
        for value in judgement.values:
            # of a number that is a column of the long records
            error = float(e.records([value.rpm]).iloc[0].get(error_of(column), np.nan)) if column else np.nan
            about = {"rig": rig, "standard_error": error, "verdict": judgement.verdict} | value._asdict()
            values.append(claim.model_dump(include={"id", "part", "unit", "rule", "tolerance"}) | about)
    return pd.DataFrame(card, columns=list(COLUMNS)), pd.DataFrame(values, columns=list(VALUE_COLUMNS))


def printed_numbers(claims: list[Claim], e: Evidence, rig: str = "") -> pd.DataFrame:
    """Numbers that the paper prints or implies of its simulation, a row each, beside those of a rig.

    Returns
    -------
    DataFrame
        ``rig, id, part, claim, rpm`` (NaN: all speeds), ``printed, measured`` (of several readings the nearest),
        ``tolerance, unit, met``. A number whose evidence is not there is not met.
    """
    rows = []
    for claim in (claim for claim in claims if claim.numbers):
        judgement = judge(claim, e)
        met = _met(claim, judgement.values)
        about = {"rig": rig, **claim.model_dump(include={"id", "part", "claim", "unit"}), "tolerance": claim.tolerance}
        if claim.numbers == 1 or not met:  # a word, a range or a limit is one number, whatever it is judged by
            number = {"rpm": np.nan, "printed": printed_text(claim, judgement.speeds), "measured": judgement.measured}
            if claim.any_reading and judgement.values:
                number["measured"] = _text(min(judgement.values, key=lambda value: value.distance).value)
            rows += [about | number | {"met": judgement.verdict == REPRODUCED}] * claim.numbers
            continue
        for (rpm, reading), is_met in met.items():
            same = [
                value
                for value in judgement.values
                if value.rpm == rpm and (claim.any_reading or value.reading == reading)
            ]
            nearest = min(same, key=lambda value: value.distance)
            ends = Range(min(value.value for value in same), max(value.value for value in same))
            measured = _text(nearest.value if ends.low == ends.high or not claim.any_reading else ends)
            rows.append(about | {"rpm": rpm, "printed": _text(nearest.printed), "measured": measured, "met": is_met})
    columns = ["rig", "id", "part", "claim", "rpm", "printed", "measured", "tolerance", "unit", "met"]
    return pd.DataFrame(rows, columns=columns)
