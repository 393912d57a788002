"""When a record of contacts ends."""

from math import ceil
from typing import Annotated

from pydantic import BeforeValidator, Field

from trackdyn.errors import InputError
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Positive, Section, plain_count
from trackdyn.scene.scene import LONGEST_RUN, Periods


class StopRule(Section):
    """Tolerances of contacts: half of the 95 % intervals of shares (points of a turn) and of RMS forces (relative),
    passages at least, and the revolutions of the loop after which a record ends in any case.
    """

    share_pct: Positive
    force: Positive
    passages: Annotated[int, Field(ge=1), BeforeValidator(plain_count)]  # 13.0 in a table of rows
    longest_turns: Annotated[float, Field(ge=1, le=1e6)]  # fewer would hold no whole passage


def steady_fields(rig: Rig, rpm: float, rule: StopRule) -> dict[str, float]:
    """Fields of a scene that records from the end of its ramp on, for as long as ``rule`` allows.

    Raises `InputError`: so many turns take longer than a record may.
    """
    seconds = rule.longest_turns * Periods.at(rig, rpm).loop
    if not seconds <= LONGEST_RUN:
        raise InputError(
            f"motor_rpm = {rpm:g}: {rule.longest_turns:g} turns of the loop take {seconds:.3g} s, a record at most "
            f"{LONGEST_RUN:g} s; use a higher speed"
        )
    return {"lead_in": 0.0, "duration": ceil(seconds * rig.sensor.rate) / rig.sensor.rate}
