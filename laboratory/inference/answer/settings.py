"""Settings of the search for rigs: ``config/answer.yaml``, whose head explains the fields."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from laboratory.inference.search import SearchMethod
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import Claim
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import Positive, Section, not_one_of, validated
from trackdyn.parameters.yaml_file import read_yaml

Count = Annotated[int, Field(ge=1)]
Numbers = Annotated[list[Positive], Field(min_length=1)]


class Row(Section):
    """How a rig is run: steps (s) that are tried one after the other until every scene runs; start of the motor (s);
    wait (s); pitch passages that are recorded.
    """

    steps_s: Numbers
    ramp_s: Positive
    lead_in_s: Positive
    passages: Count


class Searches(Section):
    """Searches by one method: evaluations that each may take, first trust region or standard deviation as a share of
    the unit cube, and seeds, each of which draws a start; they start at ``rig``, or that of the question."""

    method: SearchMethod
    evaluations: Count
    radius: Positive
    seeds: list[int]
    rig: str | None = None


class Question(Section):
    """Which claims are asked of which rigs.

    ``ranges``: ``possible`` (of ``unknowns`` and the rig's file) or ``typed`` (of ``typed`` first). ``fixed``: unknowns
    that keep the value of the rig. ``scene``: its laws. ``claims``: targets, asked at ``speeds_rpm``. ``rig``: where
    searches begin, with ``spread`` of the unit cube as standard deviation of the starts but the first.
    """

    rig: str
    ranges: Literal["typed", "possible"]
    scene: dict[str, str]
    fixed: list[str] = Field(default_factory=list)
    claims: Annotated[list[str], Field(min_length=1)]
    speeds_rpm: Numbers
    spread: Positive
    searches: Annotated[list[Searches], Field(min_length=1)]


class Law(Section):
    """A choice of the scene that differs from the question's, and unknowns that mean nothing with it."""

    scene: Annotated[dict[str, str], Field(min_length=1, max_length=1)]
    fixed: list[str] | None = None


class Profiles(Section):
    """Assumptions that are held while all else is searched again from the best rig of a question.

    ``values``: of each by the label of its unknown; ``laws``; ``evaluations``: that each value or law may take.
    """

    question: str
    evaluations: Count
    radius: Positive
    values: dict[str, Annotated[list[float], Field(min_length=2)]]
    laws: list[Law] = Field(default_factory=list)


class Robustness(Section):
    """Rigs with every free value moved by up to a share of it, and the question whose claims count."""

    rigs: Count
    share: Positive
    question: str


class Short(Section):
    """The short form: one question, the first search of each method, so many evaluations; its numbers say nothing."""

    question: str
    evaluations: Count


class AnswerConfig(Section):
    """Everything in ``config/answer.yaml``."""

    speed_rpm: Positive
    ring_radius_m: Positive
    radii_m: Numbers
    row: Row
    unknowns: Annotated[list[Unknown], Field(min_length=2)]
    typed: list[Unknown]
    questions: dict[str, Question]
    robustness: Robustness
    profiles: Profiles
    short: Short

    @model_validator(mode="after")
    def _known(self):
        labels = {unknown.label for unknown in self.unknowns}
        fixed = [name for source in (*self.questions.values(), *self.profiles.laws) for name in source.fixed or ()]
        for name in [unknown.label for unknown in self.typed] + fixed:
            if name not in labels:
                raise InputError(f"{name} is not among the unknowns")
        for where, name in (("short", self.short.question), ("profiles", self.profiles.question)):
            if name not in self.questions:
                raise InputError(f"{where}.question {not_one_of(name, self.questions)}")
        return self

    def rigs(self) -> list[str]:
        """Files of all rigs where searches start."""
        return sorted({search.rig or asked.rig for asked in self.questions.values() for search in asked.searches})

    def with_question(self, name: str, **changes) -> "AnswerConfig":
        """The same, with other fields of a question."""
        question = self.questions[name].model_copy(update=changes)
        return self.model_copy(update={"questions": self.questions | {name: question}})

    def with_law(self, law: Law) -> "AnswerConfig":
        """The same, with another law in the question of the profiles."""
        name = self.profiles.question
        question = self.questions[name]
        fixed = question.fixed if law.fixed is None else law.fixed
        return self.with_question(name, scene=question.scene | law.scene, fixed=fixed)

    def shortened(self) -> "AnswerConfig":
        """The short form."""
        question = self.questions[self.short.question]
        first = {search.method: search for search in reversed(question.searches)}  # search of each method
        less = [
            search.model_copy(update={"evaluations": self.short.evaluations, "seeds": search.seeds[:1]})
            for search in first.values()
        ]
        short = {self.short.question: question.model_copy(update={"searches": less})}
        return self.model_copy(update={"questions": short})

    def targets_of(self, question: str, claims: list[Claim]) -> list[Claim]:
        """Claims that a question asks for, in the order of the claims' file."""
        names = self.questions[question].claims
        if missing := set(names) - {claim.name for claim in claims}:
            raise InputError(f"questions.{question}.claims: {', '.join(sorted(missing))} is not a claim")
        return [claim for claim in claims if claim.name in names]


def load_answer(path: Path | str) -> AnswerConfig:
    """Read and validate."""
    return validated(AnswerConfig, read_yaml(path), str(path))


def question_unknowns(config: AnswerConfig, name: str) -> Unknowns:
    """Unknowns of a question, around the rig at which its searches begin."""
    question = config.questions[name]
    typed = {unknown.label: unknown for unknown in config.typed} if question.ranges == "typed" else {}
    free = [typed.get(unknown.label, unknown) for unknown in config.unknowns if unknown.label not in question.fixed]
    return Unknowns(free, load_rig(question.rig), file_ranges(question.rig))
