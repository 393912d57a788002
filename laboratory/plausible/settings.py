"""Settings of the study of plausible tracks: ``config/plausible.yaml``, whose head explains the fields."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from trackdyn.rig.rig import load_rig
from trackdyn.rig.validation import Positive, Section, validated
from trackdyn.rig.yaml_file import read_yaml

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


class Near(Section):
    """Neighbours of a rig: how many, and by how much their values are moved."""

    rig: str
    rigs: Count
    share: Positive


class Scenario(NamedTuple):
    """A way of the ring and a reading of the printed equal-pitch radius."""

    ring: str
    equal_pitch: str


class Search(Section):
    """A search (`search.Searching`): its scenario; radii (m) of a row by speed (rev/min); values by unknown of each
    start; standard deviation of the first steps, as a share of the ranges; most rows of a start; share of the last
    rows, and the least share of the cost that they gain.
    """

    scenario: Scenario
    radii_m: dict[float, list[float | None]]
    starts: dict[str, dict[str, float]]
    spread: Positive
    seed: int
    rows: Count
    last: Positive
    gain: Positive


class Short(Section):
    """The short form: so many draws, at fewer radii and speeds; its numbers say nothing."""

    draws: Count
    radii_m: Numbers
    speeds_rpm: Numbers


class PlausibleConfig(Section):
    """Everything in ``config/plausible.yaml``."""

    speed_rpm: Positive
    ring_radius_m: Positive
    speeds_rpm: Numbers
    radii_m: Numbers
    row: Row
    rig: str
    scene: dict[str, Any]
    draws: Count
    seed: int
    ring: dict[str, dict[str, float]]
    equal_pitch_m: dict[str, Annotated[list[Positive], Field(min_length=2, max_length=2)]]
    tooth_detail: Count
    follows: Positive
    near: Near
    search: Search
    unknowns: Annotated[list[Unknown], Field(min_length=2)]
    short: Short

    @property
    def scenarios(self) -> list[Scenario]:
        """Every way of the ring with every reading of the equal pitch."""
        return [Scenario(ring, reading) for reading in self.equal_pitch_m for ring in self.ring]

    @property
    def rigs(self) -> list[str]:
        """Files of the rigs that are run."""
        return [self.rig, self.near.rig]

    def shortened(self) -> "PlausibleConfig":
        """The short form."""
        near = self.near.model_copy(update={"rigs": 1})
        return self.model_copy(update=self.short.model_dump() | {"tooth_detail": 1, "near": near})

    def drawn_unknowns(self) -> Unknowns:
        """Unknowns of a draw, in the ranges of real parts."""
        return Unknowns(self.unknowns, load_rig(self.rig), file_ranges(self.rig))


def load_plausible(path: Path | str) -> PlausibleConfig:
    """Read and validate."""
    return validated(PlausibleConfig, read_yaml(path), str(path))
