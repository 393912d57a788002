"""What an ensemble is asked: ``config/ensemble.yaml``, whose head explains the fields."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, model_validator

from laboratory.inference.search import Round, SearchMethod
from laboratory.inference.targets import Case, CaseTarget, Rule
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import Claim
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import Positive, Section, validated
from trackdyn.parameters.yaml_file import read_yaml

Count = Annotated[int, Field(ge=0)]


class TargetEntry(Section):
    """A printed number that rigs must show; what is not given here is the claim's own (``config/claims.yaml``).

    ``output`` names a number of a run (`history.outputs`), ``item`` the place in a list of printed numbers.
    """

    claim: str
    output: str
    rpm: float | None = None
    ring_radius_m: float | None = None
    belt: bool = False
    item: int | None = None
    printed: float | None = None
    tolerance: Positive | None = None
    rule: Rule | None = None
    reason: str = ""

    @model_validator(mode="after")
    def _reasoned(self):
        if {self.printed, self.tolerance, self.rule} != {None} and len(self.reason) < 10:
            raise InputError(f"targets: {self.claim} {self.output} departs from the claim; give the reason")
        return self


class Fidelity(Section):
    """Fields of the scene, and steps that are tried one after the other until a row is not refused (s)."""

    integrator: Literal["semi_implicit", "linearly_implicit"]
    steps_s: Annotated[list[Positive], Field(min_length=1)]


class ConflictSearch(Section):
    """Sets of claims up to a size; how many of those that no rig shows are searched, the nearest of the smallest first;
    rigs from which a search is aimed at a set, and rows that each search may take (`conflicts`)."""

    size: Annotated[int, Field(ge=2)]
    sets: Count
    starts: Annotated[int, Field(ge=1)]
    evaluations: Annotated[int, Field(ge=1)]


class EnsembleForm(Section):
    """How much is computed: rigs that show the errors of cheap runs and of laws, how many of ``laws`` they are run with
    (None: all), rigs of every wave, of the last one (at full fidelity) and of the study of radii; the speeds of that
    study, its radii, and the speeds at which it runs the paper's ring alone, for what is said of records; steps of the
    walk between waves; rigs from which local searches start and neighbours of the shipped rig (`local.local_starts`),
    their first directions and rounds (`inference.search`); searches for claims that go together; jobs that a stage is
    cut into."""

    compared: Annotated[int, Field(ge=2)]
    laws: Annotated[int, Field(ge=1)] | None = None
    waves: Annotated[list[Annotated[int, Field(ge=4)]], Field(min_length=1)]
    last: Annotated[int, Field(ge=1)]
    studied: Annotated[int, Field(ge=1)]
    speeds_rpm: Annotated[list[Positive], Field(min_length=1)]
    radii_m: Annotated[list[Positive], Field(min_length=2)]
    records_rpm: Annotated[list[Positive], Field(min_length=2)]
    search_steps: Annotated[int, Field(ge=10)]
    local_starts: Annotated[int, Field(ge=1)]
    local_neighbours: Count = 0
    local_directions: Annotated[int, Field(ge=2)] | None = None
    local_rounds: Annotated[list[Round], Field(min_length=1)]
    conflicts: ConflictSearch
    batches: Annotated[int, Field(ge=1)]


class EnsembleConfig(Section):
    """Everything in ``config/ensemble.yaml``."""

    speed_rpm: Positive
    ring_radius_m: Positive
    lead_in_s: Positive
    record_turns: Positive
    belt_s: Positive
    seed: Count
    method: SearchMethod
    radius: Positive
    cutoff: Positive
    cheap: Fidelity
    full: Fidelity
    own_laws: dict[str, str]
    laws: Annotated[list[dict[str, str]], Field(min_length=1)]
    held_out: list[str]
    unknowns: Annotated[list[Unknown], Field(min_length=2)]
    targets: Annotated[list[TargetEntry], Field(min_length=1)]
    forms: dict[Literal["full", "short"], EnsembleForm]

    @model_validator(mode="after")
    def _held_out(self):
        for target in self.targets:
            if any(target.claim.startswith(held) for held in self.held_out):
                raise InputError(f"targets: {target.claim} is held out; a claim is one or the other")
        return self


def load_ensemble(path: Path | str) -> EnsembleConfig:
    """Read and validate."""
    return validated(EnsembleConfig, read_yaml(path), str(path))


def unknowns_of(config: EnsembleConfig, rig: Path | str) -> Unknowns:
    """The unknowns of a rig's file, ranges that the configuration leaves out from there."""
    return Unknowns(config.unknowns, load_rig(rig), file_ranges(rig))


def _one(value: Any, item: int | None) -> float | None:
    if isinstance(value, list):
        return None if item is None else float(value[item])
    return None if isinstance(value, (str, dict)) or value is None else float(value)


def targets_of(config: EnsembleConfig, claims: list[Claim]) -> list[CaseTarget]:
    """The targets with printed values, tolerances and rules of the claims they stand for.

    Raises
    ------
    InputError
        A claim that there is not, or one that gives no number, tolerance or rule to compare with.
    """
    known: Mapping[str, Claim] = {claim.name: claim for claim in claims}
    found = []
    for entry in config.targets:
        if entry.claim not in known:
            some = ", ".join(sorted(known)[:3])
            raise InputError(f"targets: claim {entry.claim} is unknown; {some} and others are known")
        claim = known[entry.claim]
        rpm = config.speed_rpm if entry.rpm is None else entry.rpm
        own = claim.printed.get(int(rpm)) if isinstance(claim.printed, dict) else _one(claim.printed, entry.item)
        printed = own if entry.printed is None else entry.printed
        tolerance, rule = entry.tolerance or claim.tolerance, entry.rule or claim.rule
        if printed is None or tolerance is None or rule not in get_args(Rule):
            raise InputError(
                f"targets: {entry.claim} {entry.output} has no number, tolerance or rule; give them with a reason"
            )
        case = Case(rpm, entry.ring_radius_m, entry.belt)
        numbers = {"printed": printed, "tolerance": tolerance, "rule": rule}
        found.append(CaseTarget(claim=entry.claim, output=entry.output, case=case, **numbers))
    return found
