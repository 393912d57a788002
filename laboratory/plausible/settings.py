"""Settings of the study of plausible tracks: ``config/plausible.yaml``, whose head explains the fields."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from trackdyn.inputs.validation import Positive, Section, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig import load_rig

Count = Annotated[int, Field(ge=1)]
Numbers = Annotated[list[Positive], Field(min_length=1)]


class Beginning(Section):
    """A start: ramp of the motor (s), and wait (s) in coarse steps."""

    ramp_s: Positive
    wait_s: Positive


class Row(Section):
    """Settings of the runs of a rig, whose record has ``passages`` pitch passages.

    Steps (s) are tried in order until every scene runs. The wait of a start takes steps ``coarser`` times as long, by
    the linearly implicit method; the last ``last_s`` seconds of it run as the record does, by ``integrator``.
    """

    steps_s: Numbers
    starts: Annotated[list[Beginning], Field(min_length=1)]
    coarser: Count
    last_s: Positive
    integrator: str
    passages: Count


class Near(Section):
    """Neighbours of a rig: their number, the share by which values move, and the move of the equal pitch (m)."""

    rig: str
    rigs: Count
    share: Positive
    equal_pitch_m: Positive


class Engaged(Section):
    """Tolerances of the printed engagement, a condition on tracks: of its times (s) and its share (% of a turn)."""

    time_s: Positive
    share_pct: Positive


class Start(Section):
    """A search: ``fields`` of the rig that it sets, its own ``unknowns``, and their start ``values`` by unknown."""

    fields: dict[str, float | str]
    unknowns: list[Unknown]
    values: dict[str, float] = Field(default_factory=dict)


class Search(Section):
    """Settings of all searches (`search.Searching`), and the searches by name.

    Every search begins at ``draws`` of the sample, as they are and with all combinations of the values in ``scan``.
    ``reach`` of the first step is a share of the ranges; ``rows`` is the most beyond the starts.
    """

    radii_m: dict[float, list[float | None]]
    draws: Annotated[list[int], Field(min_length=1)]
    scan: dict[str, Annotated[list[float], Field(min_length=1)]]
    searches: dict[str, Start]
    reach: Positive
    rows: Count


class Friction(Section):
    """Laws of friction of the ring that differ in one value: transition velocities (m/s) or shear stiffnesses (N/m).

    ``friction`` is the static coefficient, ``dynamic`` the dynamic one over it; ``every`` is the step in the tracks.
    """

    law: Literal["none", "regularised", "dahl"]
    values: Annotated[list[float], Field(min_length=1)]
    friction: Annotated[float, Field(ge=0)]
    dynamic: Annotated[float, Field(gt=0, le=1)] = 1.0
    every: Count = 1


class TrackRun(Section):
    """A run of sampled tracks: start (1, 2, ... of `Row`), integrator, step in the list of tracks, speeds (rev/min)."""

    start: Count
    integrator: str
    every: Count
    speeds_rpm: Numbers


class Grip(Section):
    """The study of the ring's tangential force: most tracks, radii (m) by speed (rev/min), runs, laws of friction."""

    tracks: Count
    radii_m: dict[float, Numbers]
    runs: Annotated[list[TrackRun], Field(min_length=1)]
    laws: Annotated[list[Friction], Field(min_length=1)]


class RingChoice(Section):
    """The study of the ring to choose: most tracks, radii (m), runs."""

    tracks: Count
    radii_m: Numbers
    runs: Annotated[list[TrackRun], Field(min_length=1)]


class Short(Section):
    """The short form: few draws, radii and speeds; its numbers have no meaning."""

    draws: Count
    radii_m: dict[float, Numbers]


class PlausibleConfig(Section):
    """Everything in ``config/plausible.yaml``."""

    speed_rpm: Positive
    ring_radius_m: Positive
    radii_m: dict[float, Numbers]
    row: Row
    rig: str
    scene: dict[str, Any]
    draws: Count
    seed: int
    default_draw: Annotated[int, Field(ge=0)]
    engaged: Engaged
    follows: Positive
    near: Near
    search: Search
    grip: Grip
    rings: RingChoice
    unknowns: Annotated[list[Unknown], Field(min_length=2)]
    short: Short

    @property
    def with_one_start(self) -> "PlausibleConfig":
        """Return the same with rows of the first start only."""
        return self.model_copy(update={"row": self.row.model_copy(update={"starts": self.row.starts[:1]})})

    def of_run(self, run: TrackRun) -> "PlausibleConfig":
        """Return the same with rows of the start and the integrator of a run."""
        row = {"starts": [self.row.starts[run.start - 1]], "integrator": run.integrator}
        return self.model_copy(update={"row": self.row.model_copy(update=row)})

    @property
    def rigs(self) -> list[str]:
        """Files of the rigs that are run."""
        return [self.rig, self.near.rig]

    def shortened(self) -> "PlausibleConfig":
        """Return the short form."""
        near = self.near.model_copy(update={"rigs": 1})
        radii = {rpm: sorted({*rings[:2], self.ring_radius_m}) for rpm, rings in self.grip.radii_m.items()}
        grip = self.grip.model_copy(update={"tracks": 1, "radii_m": radii, "runs": self.grip.runs[:1]})
        rings = self.rings.model_copy(update={"tracks": 1, "runs": self.rings.runs[:1]})
        few = {"near": near, "grip": grip, "rings": rings}
        return self.model_copy(update=self.short.model_dump() | few)

    def drawn_unknowns(self) -> Unknowns:
        """Unknowns of a draw, in the assumed ranges."""
        return Unknowns(self.unknowns, load_rig(self.rig), file_ranges(self.rig))


def load_plausible(path: Path | str) -> PlausibleConfig:
    """Read and validate."""
    return validated(PlausibleConfig, read_yaml(path), str(path))
