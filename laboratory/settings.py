"""How much the laboratory's studies run: ``config/laboratory.yaml``."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from replication.study.settings import Forms, StudyMethod, Values
from trackdyn.parameters.validation import Positive, Section, validated
from trackdyn.parameters.yaml_file import read_yaml


class WearPlan(Section):
    """Speeds, tensions and radii of new rings that lives begin with, and the step of the scenes."""

    speeds_rpm: Values
    tensions: Annotated[list[Literal["locked", "retensioned", "sprung"]], Field(min_length=1)]
    first_radii_m: Values
    integrator: StudyMethod
    step_s: Positive


class WearForm(Section):
    """Lives of the rigs that have a name and of so many drawn within the ranges of the parts: until which radius, how
    long the steps of the wear are.
    """

    named: WearPlan
    drawn: WearPlan
    drawn_rigs: Annotated[int, Field(ge=0)]
    until_radius_m: Positive
    step_factor: Positive


class Laboratory(Section):
    """Everything in ``config/laboratory.yaml``."""

    wear: Forms[WearForm]


def load_laboratory(path: Path | str) -> Laboratory:
    """Read and check how much is run."""
    return validated(Laboratory, read_yaml(path), path)
