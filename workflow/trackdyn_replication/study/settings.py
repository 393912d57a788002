"""Settings of the long studies (``config/studies.yaml``), and names: a study's is that of its rule and of its CSV."""

from math import ceil
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import Positive, Section, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene

Values = Annotated[list[Positive], Field(min_length=1)]
Count = Annotated[int, Field(ge=1)]
StudyMethod = Literal["semi_implicit", "linearly_implicit", "rk4"]
Steps = dict[StudyMethod, Values]
SceneKey = Annotated[tuple[Positive, Positive | None], Field(strict=False)]  # motor speed, ring radius; None: no ring

LONG_RUN = "long_run"  # which has a process of its own: growth of the memory is then its own, too
CHUNK = 50  # short runs of a process, each drawn from its number
# Laws that the other codes' own elements have: a damper parallel to a spring in a joint, and one on an axle. Rolling
# resistance would need the contacts' forces there, and rubber a state per joint.
PEER_LAWS = {"drag": "viscous", "bushing_law": "viscous"}
PICTURED = (115.0, 0.308)  # scene of the picture of accuracy against cost
# steps (s) after the radius of a ring (m) or the motor speed (rev/min) up to which each is allowed, the last beyond
Pair = Annotated[tuple[Positive, Positive], Field(strict=False)]
Allowed = Annotated[list[Pair], Field(min_length=1)]


def longest_step(steps: Allowed | None, value: float | None) -> float | None:
    """Return the step (s) allowed up to a value, the first one for None (no ring); None if no step is stated."""
    if steps is None:
        return None
    return next((step for most, step in steps if value is None or value <= most * (1 + 1e-9)), steps[-1][1])


def peer_scene(rig: Rig, reading: str, speed_rpm: float, duration: float, step: float) -> Scene:
    """Return the scene of Figure 14, ``speed_rpm`` of the sprocket or of the motor, recorded after the ramp."""
    motor = speed_rpm * (rig.sprocket.transmission_ratio if reading == "sprocket" else 1.0)
    about = {"duration": duration, "lead_in": 0.0, "ramp": 1.0, "step": step, "frame_interval": duration}
    return Scene(rig, motor, tension="locked", **PEER_LAWS, **about)  # wheels of the other codes do not move


class StatisticErrors(Section):
    """Settings for errors of the statistics of a record; ``coarse_steps_s`` for all but the full physics."""

    scenes: Annotated[list[SceneKey], Field(min_length=1)]
    loop_turns: Count
    loop_turns_without_ring: Count
    steps_s: Steps  # the two or three finest of semi_implicit give the limit that errors are taken against
    coarse_steps_s: Steps

    @model_validator(mode="after")
    def _limit(self):
        if len(set(self.steps_s.get("semi_implicit", []))) < 2:
            needed = "needs at least two steps of semi_implicit, over which limits are extrapolated"
            raise InputError(f"trade: statistics.steps_s: {needed}")
        return self


class TradeStudy(Section):
    """Settings of the study of accuracy against cost; the planner is judged on scenes ``kept_apart``."""

    statistics: StatisticErrors
    kept_apart: Annotated[list[SceneKey], Field(min_length=1)]
    promised: Annotated[list[Annotated[float, Field(gt=0, lt=1)]], Field(min_length=1)]
    limit_steps_s: Annotated[list[Positive], Field(min_length=2)]

    @model_validator(mode="after")
    def _apart(self):
        if both := [list(key) for key in self.kept_apart if key in self.statistics.scenes]:
            problem = f"kept_apart = {both[0]}: statistics.scenes holds it too"
            raise InputError(f"trade: {problem}; choose a scene that is not measured")
        return self


class ExtremesStudy(Section):
    """Settings of the extremes: sizes of every family."""

    long_run_s: Positive
    long_run_turns: Count
    short_runs: Count
    bodies: Annotated[list[Annotated[int, Field(ge=6, multiple_of=2)]], Field(min_length=1)]
    map: dict[Literal["stiffness", "speed", "ring", "tension"], Values]
    map_steps_per_ms: Values


class Studies(Section):
    """Contents of ``config/studies.yaml``."""

    trade: TradeStudy
    extremes: ExtremesStudy


STUDIES = (*Studies.model_fields, "fidelity")


# a field of a configuration that is the name of a file, and holds the studies of that
StudiesFile = Annotated[
    Studies,
    BeforeValidator(lambda path: validated(Studies, read_yaml(path), path) if isinstance(path, str) else path),
]


def scene_name(rpm: float, ring: float | None) -> str:
    """Return ``no ring 115 rpm`` or ``ring 0.308 m 115 rpm``."""
    return f"{'no ring' if ring is None else f'ring {ring:g} m'} {rpm:g} rpm"


def measured_scenes(study: TradeStudy) -> dict[str, StatisticErrors]:
    """Return settings of each measured scene by its name."""
    scenes = study.statistics.scenes
    return {_file_name(key): study.statistics.model_copy(update={"scenes": [key]}) for key in scenes}


def promised_scenes(study: TradeStudy) -> dict[str, SceneKey]:
    """Return the scenes on which the planner is judged, by their names."""
    return {_file_name(key): key for key in study.kept_apart}


def _file_name(key: tuple[float, float | None]) -> str:
    return scene_name(*key).replace(" ", "_")


def parts_of(study: ExtremesStudy) -> list[str]:
    """Return names of the parts of a study, in the order of their families."""
    return [LONG_RUN, "chain", "steps", *(f"short_runs_{k}" for k in range(len(short_run_chunks(study))))]


def short_run_chunks(study: ExtremesStudy) -> list[range]:
    """Return numbers of the short runs by chunk."""
    chunks = ceil(study.short_runs / CHUNK)
    return [range(k, study.short_runs, chunks) for k in range(chunks)]
