"""May a loop start as it lies? Not with an arc in steel, and not with a step that its tension does not allow."""

import numpy as np

from trackdyn.chain.kinematics import orient, place
from trackdyn.errors import InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.model.constants import SPROCKET, Model
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.parameters.groove import depths_on_sprocket
from trackdyn.scene.limits import advised_step, elastic_depth, step_limits
from trackdyn.scene.scene import Scene

# The weight of the chain and so many times the tension on a single arc: more than any load at rest.
MOST_LOAD = 4.0


def arc_depths(scene: Scene, model: Model, state: State, work: Work, angle: float) -> np.ndarray:
    """(2 p,) true depths of the arcs in the ten-arc groove, the sprocket at ``angle`` (rad); -inf out of its reach, m.

    Contact search (Eqs. 20 to 23) finds nothing deeper than r_C: an arc buried in a tooth would cost nothing.
    """
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    body, along, wheels = model.shoes.arc_body, model.shoes.arc_x, model.wheels
    centres = np.column_stack([
        work.pin_x[body] + along * work.cos[body] - wheels.x[SPROCKET],
        work.pin_y[body] + along * work.sin[body] - wheels.y[SPROCKET],
    ])  # fmt: skip
    return depths_on_sprocket(scene.rig.groove_profile, scene.rig.chain.connector_radius, centres, angle)


def explained_depth(model: Model, tension: float) -> float:
    """Depth that elastic contact of a tooth can have at rest, m: that of ``MOST_LOAD`` times the tension on one arc."""
    tooth = model.tooth
    load = MOST_LOAD * (tension + model.chain.gravity * float(model.chain.mass.sum()))
    widest = float(tooth.radius.max()) + tooth.arc_radius
    return elastic_depth(tooth.law, load, widest)


def refuse_start_in_steel(scene: Scene, model: Model, state: State, work: Work) -> None:
    """Refuse (`InputError`) a loop that would start with an arc deeper in a tooth than its load explains."""
    if not model.tooth.present:
        return
    depth = float(arc_depths(scene, model, state, work, float(state.wheel_angle[SPROCKET])).max())
    if depth > explained_depth(model, scene.rig.tension.pre_tension):
        raise InputError(
            f"the chain does not mesh with the sprocket of this rig: at rest an arc lies {1e3 * depth:.3g} mm inside a "
            "tooth; bring sprocket.equal_pitch_radius, groove.seat_depth and ring_radius nearer to each other"
        )


def refuse_step(scene: Scene, model: Model, tension: float) -> None:
    """Refuse (`InputError`) a step that the loop as it has settled does not allow, though the pre-tension would."""
    limits = step_limits(model, tension, METHODS[scene.integrator])
    name, limit = min(limits.items(), key=lambda item: item[1], default=("", np.inf))
    if scene.step > limit:
        raise InputError(
            f"scene: step = {scene.step!r}: the loop settles at a tension of {tension:.0f} N, for which that is too "
            f"large for the {name}, a bound that was not tried on this rig (trackdyn check tries); "
            f"{advised_step(limit, 1.0 / scene.rig.sensor.rate)}"
        )
