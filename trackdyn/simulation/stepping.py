"""One call of the time loop, and what is said when a run leaves the physical range."""

from trackdyn.errors import DivergenceError
from trackdyn.integrate.run import run
from trackdyn.model.constants import Model
from trackdyn.model.record import Record
from trackdyn.model.state import State
from trackdyn.model.work import Work


def body_name(body: int, single_pin: bool = False) -> str:
    """``link 3`` or ``connector 3``: the body as a reader would call it."""
    if single_pin:
        return f"pitch {body + 1}"
    return f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"


def march(
    model: Model, state: State, work: Work, record: Record, first: int = 0, last: int = 1, phase: str = "the run"
) -> None:
    """Integrate samples ``first`` to ``last - 1`` of ``model.stride`` steps each and fill their rows.

    Raises
    ------
    DivergenceError
        A body left the physical range: when, in which phase, which body.
    """
    bad = run(model, state, work, record, first, last)
    if bad >= 0:
        raise DivergenceError(
            f"the run left the physical range at t = {state.steps[0] * model.step:.6g} s of {phase}, first at "
            f"{body_name(bad, len(state.angle) == len(state.wheel_impact))}; "
            f"use a step smaller than {model.step:g} s, or check the rig"
        )
