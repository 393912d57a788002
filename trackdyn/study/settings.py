"""What the long studies run in their short and full forms: ``config/studies.yaml``."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from trackdyn.errors import InputError
from trackdyn.parameters.validation import NotNegative, Positive, Section, read_yaml, validated

Values = Annotated[list[Positive], Field(min_length=1)]
ValuesOrZero = Annotated[list[NotNegative], Field(min_length=1)]
Count = Annotated[int, Field(ge=1)]
Steps = dict[Literal["semi_implicit", "linearly_implicit", "rk4"], Values]
# motor speed, rev/min, and ring radius, m; None: no ring
SceneKey = tuple[Positive, Positive | None]
Window = Literal["ring 115 rpm", "ring 210 rpm", "no ring 115 rpm", "one impact", "settling under gravity"]


class StateErrors(Section):
    """Error of the state after a window: scenes, steps of each integrator, tolerances of the adaptive one."""

    scenes: Annotated[list[Window], Field(min_length=1)]
    steps_s: Steps
    tolerances: Values


class StatisticErrors(Section):
    """Error of the statistics of a record; ``coarse_steps_s`` for all but the full physics."""

    scenes: Annotated[list[SceneKey], Field(min_length=1)]
    loop_turns: Count
    steps_s: Steps
    coarse_steps_s: Steps
    second_reference: bool


class Scaling(Section):
    """Equal runs on one process and on two."""

    runs: Annotated[list[Count], Field(min_length=1)]
    duration_s: Positive


class TradeForm(Section):
    """One form of the study of accuracy against cost."""

    state: StateErrors
    statistics: StatisticErrors
    kept_apart: Annotated[list[SceneKey], Field(min_length=1)]
    scaling: Scaling

    @model_validator(mode="after")
    def _apart(self):
        if both := [list(key) for key in self.kept_apart if key in self.statistics.scenes]:
            raise InputError(
                f"trade: kept_apart = {both[0]} is not accepted: statistics.scenes holds it too; a scene that is not "
                "measured would do"
            )
        return self


class LongRun(Section):
    """Simulated time, and revolutions of the loop in a chunk of it."""

    duration_s: Positive
    loop_turns: Count


class Friction(Section):
    """Coefficients, each with every transition velocity."""

    coefficients: ValuesOrZero
    velocities_m_s: Values


class Bushing(Section):
    """Dampings, each with every integrator."""

    dampings_nms: ValuesOrZero
    integrators: Annotated[list[Literal["semi_implicit", "linearly_implicit", "rk4"]], Field(min_length=1)]


class StabilityMap(Section):
    """Moduli of the teeth, and steps as their number in a millisecond."""

    moduli_pa: Values
    steps_per_ms: Values


class ExtremesForm(Section):
    """One form of the extremes: how much of every family runs."""

    long_run: LongRun
    random_scenes: Count
    bodies: list[Annotated[int, Field(ge=6, multiple_of=2)]]
    mass_ratios: Values
    moduli_pa: Values
    friction: Friction
    bushing: Bushing
    speeds_rpm: ValuesOrZero
    ring_radii_m: Values
    depths_m: Values
    stability_map: StabilityMap


class Trade(Section):
    """Both forms of the study of accuracy against cost."""

    short: TradeForm
    full: TradeForm


class Extremes(Section):
    """Both forms of the extremes."""

    short: ExtremesForm
    full: ExtremesForm


class Studies(Section):
    """Everything in ``config/studies.yaml``."""

    trade: Trade
    extremes: Extremes


def _read(path: Any) -> Any:
    """The studies of the file that a configuration names."""
    return validated(Studies, read_yaml(path), path) if isinstance(path, str) else path


# a field of a configuration that is the name of a file, and holds what stands there
StudiesFile = Annotated[Studies, BeforeValidator(_read)]
