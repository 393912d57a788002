"""How much the laboratory's studies run: ``config/laboratory.yaml``."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from replication.study.settings import StudySizes, Values
from trackdyn.parameters.validation import Positive, Section, validated
from trackdyn.parameters.yaml_file import read_yaml


class WearForm(Section):
    """Speeds, tensions and radii of new rings of the lives, the step of their scenes, and the radius that ends them."""

    speeds_rpm: Values
    tensions: Annotated[list[Literal["locked", "retensioned", "sprung"]], Field(min_length=1)]
    first_radii_m: Values
    step_s: Positive
    until_radius_m: Positive


class Laboratory(Section):
    """Everything in ``config/laboratory.yaml``."""

    wear: StudySizes[WearForm]


def load_laboratory(path: Path | str) -> Laboratory:
    """Read and check how much is run."""
    return validated(Laboratory, read_yaml(path), path)
