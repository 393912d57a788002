"""When a record of contacts ends."""

from math import ceil
from typing import Annotated

from pydantic import BeforeValidator, Field

from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Positive, Section, plain_count
from trackdyn.scene.scene import Periods


class StopRule(Section):
    """Tolerances of contacts: half of the 95 % intervals of shares (points of a turn) and of RMS forces (relative),
    passages at least, and the revolutions of the loop after which a record ends in any case.
    """

    share_pct: Positive
    force: Positive
    passages: Annotated[int, Field(ge=1), BeforeValidator(plain_count)]  # 13.0 in a table of rows
    longest_turns: Annotated[float, Field(ge=1, le=1e6)]  # fewer would hold no whole passage


def steady_fields(rig: Rig, rpm: float, rule: StopRule) -> dict[str, float]:
    """Fields of a scene that records from the end of its ramp on, for as long as ``rule`` allows."""
    return {
        "lead_in": 0.0,
        "duration": ceil(rule.longest_turns * Periods.at(rig, rpm).loop * rig.sensor.rate) / rig.sensor.rate,
    }
