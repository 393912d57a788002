"""Judge every claim of the paper by the results of the runs of a rig."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import NotNegative, Section, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.measure.columns import TABLES
from trackdyn_replication.paper.evidence import Evidence
from trackdyn_replication.paper.measures import MEASURES, NotThere, Range

MET, NOT_MET, NO_TEST, NOT_COMPARABLE = "met", "not met", "no test", "not comparable"
JUDGED = (MET, NOT_MET)
# groups of printed numbers, with their words in a count
INDEPENDENT = "independent"
GROUPS = {
    INDEPENDENT: "independent printed numbers",
    "same time": "that repeat a time in other units",
    "wheels": "that the wheels decide",
    "ours": "that we infer",
}
VERDICTS = (*JUDGED, NO_TEST, NOT_COMPARABLE)
ONE_SIDED = ("at_most", "at_least")
SLACK = 1 + 1e-9  # on a tolerance: 0.309 - 0.308 is more than 0.001 in binary
COLUMNS, NUMBER_COLUMNS = (tuple(TABLES[name][1]) for name in ("claims", "printed_numbers"))


class Claim(Section):
    """One row of ``config/claims.yaml``, whose head explains the fields."""

    id: Annotated[str, Field(pattern=r"^C\d\d$")]
    part: Annotated[str, Field(pattern=r"^[a-z]?$")] = ""
    sentence: int | None = None  # of the paper; a claim without one is not counted
    place: str
    claim: str
    printed: Any = None  # by motor speed: at the speeds that are judged
    ours: bool = False
    unit: str = "1"
    measure: str | None = None
    rule: Literal["equal", "at_most", "at_least", "rising", "same", "no_test", "not_comparable"]
    tolerance: float | None = None
    within: NotNegative = 0.0
    growth: NotNegative = 0.0  # of a rising quantity, from the first value to the last
    any_reading: bool = False  # whether one reading that is met suffices, at every speed
    numbers: Annotated[int, Field(ge=0)] = 0  # printed or implied ones (`printed_numbers`)
    group: Literal["", *GROUPS] = ""  # type: ignore[valid-type]
    number_names: dict[float, str] | list[str] = Field(default_factory=list)
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
            meant = f"; did you mean {near[0]!r}?" if near else "; trackdyn_replication/paper/measures.py has them all"
            raise InputError(f"claim {self.name}: measure = {self.measure!r} is not a measure{meant}")
        if self.rule == "equal" and self.tolerance is None:
            raise InputError(f"claim {self.name}: tolerance is missing; the rule equal needs one, with its reason")
        if len(self.number_names) != (self.numbers if self.numbers > 1 else 0):
            named = f"number_names has {len(self.number_names)} names for {self.numbers} numbers"
            raise InputError(f"claim {self.name}: {named}; name each of several, and none of one")
        if bool(self.group) != bool(self.numbers):
            raise InputError(
                f"claim {self.name}: group = {self.group!r} for {self.numbers} numbers; numbers have one of "
                f"{', '.join(GROUPS)}, and a claim without numbers has no group"
            )
        if not self.fails_if:
            raise InputError(f"claim {self.name}: fails_if is missing; state a result that fails the claim")
        return self


class Claims(Section):
    """File of claims: sentences of the paper by number, and their statements."""

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
    """Return the sentences of the paper by their numbers, in its order; `InputError` as `load_claims`."""
    return validated(Claims, read_yaml(path), str(path), missing="every claim needs it").sentences


class Value(NamedTuple):
    """One number that a claim is judged by."""

    rpm: float  # motor speed, rev/min; NaN for a number that belongs to all speeds
    value: float
    printed: float  # the value it is compared with; NaN for a trend
    met: bool  # whether it is as claimed


class Judgement(NamedTuple):
    """Result of judging a claim."""

    measured: str  # the measured value as text, or why there is none
    verdict: str
    speeds: list[float]  # at which it was judged, rev/min
    values: tuple[Value, ...] = ()  # basis of the verdict: none for text, and where nothing is tested


def _values(claim: Claim, measured, speeds) -> tuple[Value, ...]:
    """Return the numbers of a measure, each with its own test; the ends of a range are two."""
    if isinstance(measured, str) or claim.rule not in (*ONE_SIDED, "equal", "rising"):
        return ()
    items = [measured] if isinstance(measured, Range | float) else list(measured)
    numbers = np.array(items, dtype=float).reshape(len(items), -1)
    printed = np.full((len(items), 1), np.nan)
    if claim.rule == "rising":
        met = np.isfinite(numbers) & np.r_[[[True]], numbers[1:] > (1 - claim.within) * numbers[:-1]]
        met[-1] &= numbers[-1] > (1 + claim.growth) * numbers[0] if claim.growth else True
    else:
        by_speed = isinstance(claim.printed, dict)
        printed[:, 0] = [claim.printed[rpm] for rpm in speeds] if by_speed else claim.printed
        difference = numbers - printed
        side = {"at_most": difference, "at_least": -difference, "equal": np.abs(difference)}[claim.rule]
        leeway = SLACK * claim.tolerance if claim.rule == "equal" else claim.within * np.abs(printed)
        met = (side <= leeway) & np.isfinite(numbers)
        if claim.any_reading:  # any value within a range is a reading
            met |= (numbers[:, :1] <= printed) & (printed <= numbers[:, -1:])
    if not (MEASURES[claim.measure].by_speed and len(items) == len(speeds)):
        speeds = [speeds[0] if len(speeds) == 1 else np.nan] * len(items)
    return tuple(
        Value(rpm, float(value), float(bound), bool(good))
        for rpm, row, (bound,), row_met in zip(speeds, numbers, printed, met, strict=True)
        for value, good in zip(row, row_met, strict=True)
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
        if wide:
            scatters = f"passages scatter by {scatter[wide[0]]:.2g} {claim.unit}, more than the tolerance"
            raise NotThere(f"{wide[0]}: {scatters}")
    except NotThere as missing:
        return Judgement(str(missing), NOT_COMPARABLE, speeds)
    values = _values(claim, measured, speeds)
    if claim.rule == "no_test":
        verdict = NO_TEST
    elif claim.rule == "same":
        verdict = MET if measured == claim.printed else NOT_MET
    else:
        shown = [any(value.met for value in group) for group in _groups(claim, values)]
        verdict = MET if shown and all(shown) else NOT_MET
    return Judgement(_text(measured), verdict, speeds, values)


def _groups(claim: Claim, values: Iterable[Value]) -> list[list[Value]]:
    """Group the numbers of a claim, met if one of each group is: by speed with `Claim.any_reading`, else each."""
    groups: dict[float, list[Value]] = {}
    for k, value in enumerate(values):
        groups.setdefault(value.rpm if claim.any_reading else k, []).append(value)
    return list(groups.values())


def _text(value) -> str:
    if value is None:
        return ""
    if isinstance(value, Range | float) and np.isnan(value).any():
        return "no value"  # such as a ratio of forces that never act
    if isinstance(value, Range):
        return f"{_text(value.low)} to {_text(value.high)}"
    if isinstance(value, list | tuple):
        return ("; " if any(isinstance(item, Range) for item in value) else ", ").join(map(_text, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def printed_text(claim: Claim, speeds=()) -> str:
    """Return the value to compare with as text: a printed number, our bound for the paper's words, or only words."""
    if claim.rule == "rising":
        return "in words"
    value = claim.printed
    text = _text([value[rpm] for rpm in speeds]) if isinstance(value, dict) else _text(value)
    return f"ours: {claim.rule.replace('_', ' ')} {text}" if claim.ours else text


def judge_all(claims: list[Claim], e: Evidence, rig: str = "") -> pd.DataFrame:
    """Return the scorecard of a rig of this name: a row for every statement, columns ``COLUMNS``."""
    rows = []
    for claim in claims:
        measured, verdict, speeds, _ = judge(claim, e)
        otherwise = "" if verdict in (MET, NOT_COMPARABLE) else claim.otherwise
        rows.append({
            **claim.model_dump(include={"id", "part", "sentence", "place", "claim", "unit", "fails_if"}),
            "rig": rig, "printed": printed_text(claim, speeds), "measured": measured, "verdict": verdict,
            "tolerance": _text(claim.tolerance), "speeds": ", ".join(f"{rpm:g}" for rpm in speeds),
            "by_speed": verdict != NOT_COMPARABLE and MEASURES[claim.measure].by_speed,
            "reason": " ".join(filter(None, (claim.reason, otherwise))),
        })  # fmt: skip
    return pd.DataFrame(rows, columns=list(COLUMNS))


def printed_numbers(claims: list[Claim], e: Evidence, rig: str = "") -> pd.DataFrame:
    """Compare each number that the paper prints or implies of its simulation with a rig's, not met without evidence."""
    rows = []
    for claim in (claim for claim in claims if claim.numbers):
        judgement = judge(claim, e)
        about = {"rig": rig, **claim.model_dump(include={"id", "part", "unit", "tolerance", "group"})}
        names = claim.number_names or [claim.claim]
        groups = _groups(claim, judgement.values)
        if claim.numbers == 1 or not groups:  # a word, a range or a limit is one number, whatever it is judged by
            number = {"printed": printed_text(claim, judgement.speeds), "measured": judgement.measured}
            every = names.values() if isinstance(names, dict) else names
            rows += [about | number | {"claim": name, "met": judgement.verdict == MET} for name in every]
            continue
        for k, group in enumerate(groups):
            name = names[group[0].rpm if isinstance(names, dict) else k]
            ends = Range(min(value.value for value in group), max(value.value for value in group))
            rows.append(about | {
                "claim": name, "rpm": group[0].rpm, "printed": _text(group[0].printed),
                "measured": _text(ends.low if ends.low == ends.high else ends),
                "met": any(value.met for value in group),
            })  # fmt: skip
    return pd.DataFrame(rows, columns=list(NUMBER_COLUMNS))
