"""Extremes of restitution and of initial states: a generator of rows for each family."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from replication.study.extremes.judge import FAST, attempted, below, gap_bound, gap_missed, run_scene, within_bounds
from trackdyn.contact.laws import friction_coefficient, normal_force
from trackdyn.contact.tooth import find_area
from trackdyn.jit import kernel
from trackdyn.model.constants import SPROCKET, Drive
from trackdyn.parameters.normal_laws import delivered_restitution
from trackdyn.parameters.rig import Rig
from trackdyn.scene.build import make_law, make_tooth
from trackdyn.scene.scene import Scene
from trackdyn.simulation.account import open_share, refuse_open_account
from trackdyn.simulation.loop import Loop

# Change of momentum in turns a step: it is that of the path between two configurations.
MOMENTUM = 10.0
STEEL_AND_TOOTH = ("steel__youngs_modulus", "tooth_contact__youngs_modulus")
SURFACES = ("tooth_contact", "ring_contact", "wheel_contact")
STATES = "initial state"


def restart(rig: Rig, rpm: float = 210.0, **fields) -> Loop:
    """A settled loop."""
    return Loop(Scene(rig, rpm, **(FAST | fields)))


def run_on(loop: Loop, seconds: float) -> dict:
    """Run on from a state, step by step; columns of the row, with the first bound that is missed in ``reason``."""
    loop._parts = loop._parts._replace(model=loop._parts.model._replace(stride=1))
    record = loop.room(max(round(seconds / loop.model.step), 1))
    turn = 0.0
    for step in range(len(record.gap)):
        loop.fill(record, step, step + 1)
        turn = max(turn, float(np.abs(loop.state.rate).max()) * loop.model.step)
    arrays = (record.energy, record.gap, record.raw, *(array for array in loop.state if isinstance(array, np.ndarray)))
    if not all(np.isfinite(array.view(float) if array.dtype.names else array).all() for array in arrays):
        return {"reason": "numbers that are not finite"}
    gap = float(record.gap.max())
    refuse_open_account(record.energy, loop.model, seconds)
    share = open_share(record.energy, loop.model, seconds)[0]
    return {"loop_gap_max_m": gap, "energy_residual": share, "turn": turn, "reason": gap_missed(gap, gap_bound(turn))}


def lighter(rig: Rig, ratio: float) -> dict[str, float]:
    """Changes of a rig that make its links so many times as heavy as its connectors."""
    return {f"chain__connector_{what}": getattr(rig.chain, f"link_{what}") / ratio for what in ("mass", "inertia")}


@kernel
def _rebound(law, mass, speed, radius, steps):
    """Speed after over speed before an impact on one surface, by leapfrog steps of a ``steps``-th of a half period."""
    x, v = 0.0, speed
    h = np.sqrt(mass * radius**0.5 / (law.stiffness * (speed + 1e-9) ** 0.5)) / steps
    for _ in range(1000 * steps):
        x += 0.5 * h * v
        if x <= 0.0:
            break
        v -= h * normal_force(law, x, v, speed, radius) / mass
        x += 0.5 * h * v
        if x <= 0.0:
            break
    return -v / speed


def _impact(rig: Rig, law_name: str, value: float) -> dict:
    surface = rig.tooth_contact
    law = make_law(
        surface.contact_length, rig.composite_modulus(surface), value, 0.0, 0.0, 1.0, 1e-9, rig.impact.factor_limit,
        law_name,
    )  # fmt: skip
    expected = delivered_restitution(law.loss) if law_name == "printed" else value
    restitution = _rebound(law, rig.chain.link_mass, 0.5, 0.08, 4000)
    return within_bounds(restitution, expected, 2e-3, "restitution", group=law_name, at=value)


def restitution(
    rig: Rig, nominal=(0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)
) -> Iterator[dict]:
    """What an impact gives back against what it should, for both normal laws; the same in a running loop."""
    for law, value in product(("printed", "delivered"), nominal):
        yield attempted("restitution", f"one impact, {law}, {value:g}", _impact, rig, law, value)
    for law, value in product(("printed", "delivered", "elastic"), (0.0, 5e-324, 1e-300, 0.01, 0.1, 0.5, 1.0, 1.01)):
        changes = {f"{name}__restitution": value for name in SURFACES}
        yield run_scene("restitution", f"loop, {law}, {value:g}", rig, changes=changes, normal_law=law)


def states(rig: Rig, depths: list[float]) -> Iterator[dict]:
    """Loops let go from where no run would start: deep in a tooth or a ring, on a tip, stopped, at almost no speed."""
    for (name, wheel), depth in product((("sprocket", SPROCKET), ("idler", 1)), depths):
        yield attempted(STATES, f"{name} pushed {1e3 * depth:g} mm into the chain", _pushed, rig, wheel, depth)
    for share in (0.05, 0.25, 0.5):
        yield attempted(STATES, f"sprocket turned by {share:g} of a pitch under the chain", _turned, rig, share)
    yield attempted(STATES, "an arc exactly at a tooth tip", _on_tip, rig)
    for rpm in (115.0, 210.0, 500.0):
        yield attempted(STATES, f"sudden stop from {rpm:g} rpm", _stopped, rig, rpm)
    for name, value in (("zero", 0.0), ("denormal", 5e-324), ("1e-160", 1e-160), ("denormal, reversed", -5e-324)):
        yield attempted(STATES, f"all rates and stored impact velocities {name}", _crept, rig, value)


def _pushed(rig: Rig, wheel: int, depth: float) -> dict:
    started = restart(rig, 0.0)
    wheels = started._parts.model.wheels
    away = np.array([wheels.x[wheel] + 0.55, wheels.y[wheel] + 0.2])
    away /= np.hypot(*away)
    wheels.x[wheel] += depth * away[0]
    wheels.y[wheel] += depth * away[1]
    return run_on(started, 0.1)


def _stopped(rig: Rig, rpm: float) -> dict:
    started = restart(rig, rpm)
    run_on(started, 0.3)
    model = started.model
    started._parts = started._parts._replace(model=model._replace(drive=Drive(0.0, model.step)))
    return run_on(started, 0.2)


def _turned(rig: Rig, share: float) -> dict:
    started = restart(rig, 0.0)
    started._parts.state.wheel_angle[SPROCKET] += share * 2 * np.pi / started.model.tooth.teeth
    return run_on(started, 0.1)


def _on_tip(rig: Rig) -> dict:
    started = restart(rig, 0.0)
    wheels = started._parts.model.wheels
    to_pins = started.pins[:-1] - [wheels.x[SPROCKET], wheels.y[SPROCKET]]
    x, y = to_pins[np.argmin((to_pins**2).sum(axis=1))]
    # the line between two grooves through the centre of an arc
    started._parts.state.wheel_angle[SPROCKET] = np.arctan2(y, x)
    return run_on(started, 0.1)


def _crept(rig: Rig, value: float) -> dict:
    started = restart(rig, 0.0)
    state = started._parts.state
    for array in (state.rate, state.wheel_rate):
        array[...] = value
    for array in (state.tooth_impact, state.wheel_impact):
        array[...] = abs(value)
    state.pin[2:] = value
    return run_on(started, 0.05)


def laws(rig: Rig) -> Iterator[dict]:
    """The laws at the ends of their arguments, the joints of the areas and the symmetry of the groove."""
    law = Scene(rig, 0.0).model.tooth.law
    yield attempted(STATES, "normal force and friction from denormal to huge arguments", _finite, law)
    tooth = make_tooth(rig.groove_profile, rig.chain.connector_radius, law)
    for joint in range(1, 10):
        case = f"an arc on the line between areas {joint} and {joint + 1}"
        yield attempted(STATES, case, _continuous, rig.groove_profile, tooth, joint)
    yield attempted(STATES, "20,000 arcs and their mirror images in a groove", _mirrored, tooth)


def _finite(law) -> dict:
    numbers = (0.0, 5e-324, 1e-300, 1e-12, 1.0, 1e6)
    forces = np.array([
        normal_force(law, depth, sign * rate, max(law.speed_floor, impact), 0.01)
        for depth in numbers for rate in numbers for sign in (-1.0, 1.0) for impact in numbers
    ])  # fmt: skip
    coefficients = [friction_coefficient(law, sign * slip) for slip in numbers for sign in (-1.0, 1.0)]
    faulty = np.sum(~np.isfinite([*forces, *coefficients])) + np.sum(forces < 0)
    return below(float(faulty), 0.0, "faulty forces")


def _continuous(groove, tooth, joint: int) -> dict:
    """Depth on both sides of the line that two areas share, and on it."""
    depth, tolerance = 1e-4, 1e-9
    on = groove.joints()[joint - 1]
    normal = on - groove.centre[joint - 1]
    normal /= np.hypot(*normal) * (1 if groove.convex[joint - 1] else -1)
    along = np.array([normal[1], -normal[0]])
    centre = on + (tooth.arc_radius - depth) * normal
    seen = [find_area(tooth, *(centre + side * along))[:2] for side in (-1e-10, 0.0, 1e-10)]
    worst = max(abs(computed - depth) for _, computed in seen)
    return below(worst, tolerance, "jump of the depth in m", at=joint)


def _mirrored(tooth) -> dict:
    rng = np.random.default_rng(8)
    worst = 0.0
    for x, y in np.column_stack([rng.uniform(1e-6, 0.08, 20000), rng.uniform(0.24, 0.36, 20000)]):
        right, left = find_area(tooth, x, y), find_area(tooth, -x, y)
        areas = 0.0 if right[0] == (11 - left[0] if left[0] else 0) else 1.0
        worst = max(worst, areas, *np.abs(np.array(right[1:]) - np.array(left[1:]) * [1, -1, 1, 1]))
    return below(worst, 1e-12, "asymmetry of area, depth, normal or radius")


def momentum(rig: Rig, pitches=(3, 5, 35, 200)) -> Iterator[dict]:
    """A free loop without gravity: linear and angular momentum stay, to the order of the step.

    A first-order step moves the bodies before it counts them, so that both swing by a turn a step and do not drift.
    """
    for count, damping in product(pitches, (0.0, 12.4)):
        case = f"free loop of {count} pitches, damping {damping:g}"
        yield attempted("momentum", case, _free, rig, count, damping)


def _free(rig: Rig, count: int, damping: float) -> dict:
    free = rig.changed(gravity=0.0, chain__pitches=count, bushing__damping=damping)
    started = restart(free, 210.0, loop="free", ring_radius=None, bushing_law="viscous")
    begin = started.momentum
    # linear momentum is zero: its scale is that of the bodies' own
    momentum_scale = float(started.model.chain.mass @ np.hypot(started.work.com_vx, started.work.com_vy))
    outcome = run_on(started, 0.2)
    end = started.momentum
    change = max(abs(end[2] / begin[2] - 1), np.hypot(*(end[:2] - begin[:2])) / momentum_scale)
    bound = MOMENTUM * max(outcome["turn"], 1e-4)
    return outcome | below(float(change), bound, "change of momentum", at=count)
