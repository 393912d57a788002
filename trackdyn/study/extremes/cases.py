"""Extremes of parameters, speeds, steps and initial states: a generator of rows for each family."""

from collections.abc import Iterator
from math import ceil

import numpy as np

from trackdyn.chain.kinematics import orient, place
from trackdyn.contact.laws import delivered_restitution, friction_coefficient, make_law, normal_force
from trackdyn.contact.loads import contact_loads
from trackdyn.contact.tooth import find_area, make_tooth
from trackdyn.errors import DivergenceError
from trackdyn.integrate.limits import open_share, refuse_open_account, step_limits
from trackdyn.integrate.run import run
from trackdyn.jit import kernel
from trackdyn.model import SPROCKET, Drive, Model, State, Work
from trackdyn.parameters.layout import assemble
from trackdyn.parameters.rig import Rig
from trackdyn.scene import Scene, build_model
from trackdyn.settling import body_name, empty_record, settle
from trackdyn.study.extremes.judge import (
    FAST,
    below,
    gap_bound,
    judged,
    run_scene,
    within,
)

# Change of momentum in turns a step: it is that of the path between two configurations.
MOMENTUM = 10.0
STEEL_AND_TOOTH = ("steel__youngs_modulus", "tooth_contact__youngs_modulus")
SURFACES = ("tooth_contact", "ring_contact", "wheel_contact")


def step_limit(rig: Rig, rpm: float = 210.0, **fields) -> float:
    """Smallest of the predicted limits of the semi-implicit step, s."""
    probe = Scene(rig, rpm, **(FAST | fields), integrator="adaptive", tolerance=0.5)
    return min(step_limits(build_model(probe), rig.tension.pre_tension).values())


def accepted_step(rig: Rig, limit: float, at_most: float = 1e-4) -> float:
    """Largest whole fraction of the sample interval within a limit, s."""
    sample = 1.0 / rig.sensor.rate
    return sample / ceil(sample / min(limit, at_most) * (1 - 1e-9))


def restart(rig: Rig, rpm: float = 210.0, **fields) -> tuple[Scene, Model, State, Work]:
    """A settled loop with everything that the kernels need."""
    scene = Scene(rig, rpm, **(FAST | fields))
    return scene, *settle(scene)[:3]


def march(model: Model, state: State, work: Work, seconds: float) -> dict:
    """Run on from a state, step by step; columns of the row, with the first bound that is missed in ``reason``."""
    steps = max(round(seconds / model.step), 1)
    record = empty_record(steps, len(state.angle), len(model.wheels.x), loop=len(state.wheel_impact))
    turn = 0.0
    for step in range(steps):
        bad = run(model, state, work, record, step, step + 1, 1)
        if bad >= 0:
            raise DivergenceError(
                f"the run left the physical range {state.steps[0] * model.step:.4g} s after the start, first at {body_name(bad)}"
            )
        turn = max(turn, float(np.abs(state.rate).max()) * model.step)
    if not all(np.isfinite(part).all() for part in (*state, record.energy, record.gap, record.raw)):
        return {"reason": "numbers that are not finite"}
    gap = float(record.gap.max())
    found = {"loop_gap_max_m": gap, "energy_residual": open_share(record.energy, model, seconds)[0], "turn": turn}
    refuse_open_account(record.energy, model, seconds)
    missed = gap > gap_bound(turn)
    return found | {"reason": f"the loop gap is {gap:.3g} m, more than {gap_bound(turn):.2g} m" if missed else ""}


def mass_ratio(rig: Rig, ratios=(1, 10, 1e2, 1e3, 1e4, 1e5, 1e6)) -> Iterator[dict]:
    """A link from as heavy as a connector to a million times heavier; a massless connector."""
    for ratio in ratios:
        changes = {"chain__connector_mass": rig.chain.link_mass / ratio}
        changes |= {"chain__connector_inertia": rig.chain.link_inertia / ratio}
        for name, fields in (
            ("step 1e-4 s", {}),
            ("step 1e-5 s", {"step": 1e-5}),
            ("linearly implicit", {"integrator": "linearly_implicit"}),
        ):
            yield run_scene("mass ratio", f"link to connector {ratio:g}, {name}", rig, changes=changes, **fields)
    for value in (0.0, -1.0, 5e-324):
        yield run_scene("mass ratio", f"connector of {value:g} kg", rig, changes={"chain__connector_mass": value})


def stiffness(rig: Rig, moduli=(1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 2.1e11, 1e12, 2e12)) -> Iterator[dict]:
    """Teeth of rubber to ten times the modulus of steel, at the largest accepted and at a refused step."""
    for modulus in moduli:
        changes = dict.fromkeys(STEEL_AND_TOOTH, modulus)
        for ring in (None, 0.308):
            limit = step_limit(rig.changed(**changes), ring_radius=ring)
            step = accepted_step(rig, limit, 1e-3)
            where = f"E = {modulus:g} Pa, {'no ring' if ring is None else 'ring'}"
            yield run_scene("stiffness", f"{where}, largest step", rig, changes=changes, ring_radius=ring, step=step)
            larger = 1e-3 / max(int(1e-3 / limit), 1)  # the next whole fraction above the limit
            larger = larger if larger > limit else 2e-3
            yield run_scene("stiffness", f"{where}, next step", rig, changes=changes, ring_radius=ring, step=larger)
            yield run_scene(
                "stiffness", f"{where}, linearly implicit", rig, changes=changes, ring_radius=ring,
                integrator="linearly_implicit",
            )  # fmt: skip
    for value in (0.0, -1.0, float("nan"), float("inf"), 1e30):
        yield run_scene("stiffness", f"E = {value:g} Pa", rig, changes={STEEL_AND_TOOTH[1]: value})
    for value in (0.0, 1e3, 1e4, 1e6):
        yield run_scene("stiffness", f"bushing of {value:g} N m/rad", rig, changes={"bushing__stiffness": value})


@kernel
def _impact(law, mass, speed, radius, steps):
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


def restitution(
    rig: Rig, nominal=(0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)
) -> Iterator[dict]:
    """What an impact gives back against what it should, for both normal laws; the same in a running loop."""
    surface = rig.tooth_contact
    for law_name in ("printed", "delivered"):
        for value in nominal:

            def attempt(law_name=law_name, value=value):
                law = make_law(
                    surface.contact_length, rig.composite_modulus(surface), value, 0.0, 0.0, 1.0, 1e-9,
                    rig.impact.factor_limit, law_name,
                )  # fmt: skip
                expected = delivered_restitution(law.loss) if law_name == "printed" else value
                found = _impact(law, rig.chain.link_mass, 0.5, 0.08, 4000)
                return within(found, expected, 2e-3, "restitution", group=law_name, at=value)

            yield judged("restitution", f"one impact, {law_name}, {value:g}", attempt)
    for law_name in ("printed", "delivered", "elastic"):
        for value in (0.0, 5e-324, 1e-300, 0.01, 0.1, 0.5, 1.0, 1.01):
            changes = {f"{name}__restitution": value for name in SURFACES}
            yield run_scene("restitution", f"loop, {law_name}, {value:g}", rig, changes=changes, normal_law=law_name)


def friction(
    rig: Rig, coefficients=(0.0, 0.1, 0.5, 1.0, 2.0), velocities=(1e-4, 1e-3, 1e-2, 0.1, 1.0)
) -> Iterator[dict]:
    """No friction to a coefficient of 2, with transition velocities down to 0.1 mm/s, on every surface."""
    for mu in coefficients:
        for velocity in velocities:
            changes = {f"{name}__{field}": mu for name in SURFACES for field in ("friction_static", "friction_dynamic")}
            changes |= {f"{name}__transition_velocity": velocity for name in SURFACES}
            case = f"mu {mu:g}, v_t {velocity:g} m/s"
            yield run_scene("friction", f"{case}, step 1e-4 s", rig, changes=changes)
            yield run_scene(
                "friction", f"{case}, linearly implicit", rig, changes=changes, integrator="linearly_implicit"
            )
    for mu in (-0.1, 2.1):
        yield run_scene("friction", f"mu {mu:g}", rig, changes={"tooth_contact__friction_static": mu})
    yield run_scene("friction", "v_t 0", rig, changes={"tooth_contact__transition_velocity": 0.0})


def bushing(rig: Rig, dampings=(0.0, 1.0, 12.4, 1e2, 1e3, 1e4, 1e6, 1e9), others=("rk4",)) -> Iterator[dict]:
    """Bushings without damping to such as never turn; critical damping is of the order of 2 N m s/rad."""
    for damping in dampings:
        for integrator in ("semi_implicit", "linearly_implicit", *others):
            case = f"damping {damping:g} N m s/rad, {integrator}"
            yield run_scene("bushing", case, rig, changes={"bushing__damping": damping}, integrator=integrator)


def speed(rig: Rig, speeds=(0.0, 1e-3, 1.0, 115.0, 210.0, 1000.0, 2000.0, 10000.0)) -> Iterator[dict]:
    """At rest to 48 times the fastest run, reversed, abrupt starts and a sudden stop."""
    for rpm in speeds:
        for ramp in (1.0, 0.001):
            limit = step_limit(rig, rpm)
            step = accepted_step(rig, limit)
            for name, value in {"1e-4": 1e-4, f"{step:.3g}": step}.items():
                yield run_scene(
                    "speed", f"{rpm:g} rpm, ramp {ramp:g} s, step {name} s", rig, rpm, ramp=ramp, step=value
                )
    for rpm in (-5.0, float("nan"), float("inf"), 1e9):
        yield run_scene("speed", f"{rpm:g} rpm", rig, rpm)
    for rpm in (115.0, 210.0, 500.0):

        def attempt(rpm=rpm):
            _, model, state, work = restart(rig, rpm)
            march(model, state, work, 0.3)
            return march(model._replace(drive=Drive(0.0, model.step)), state, work, 0.2)

        yield judged("speed", f"sudden stop from {rpm:g} rpm", attempt)


def loop(rig: Rig, radii=tuple(np.round(np.arange(0.25, 0.3551, 0.005), 3))) -> Iterator[dict]:
    """Rings, pre-tension from slack to 100 kN, loops that just close and just do not."""
    for radius in (None, *map(float, radii)):
        yield run_scene("loop", f"ring {'none' if radius is None else f'{radius:g} m'}", rig, 115.0, ring_radius=radius)
    for tension in (0.0, 1.0, 1e2, 1e3, 4540.0, 1e4, 2e4, 5e4, 1e5):
        changes = {"tension__pre_tension": tension}
        yield run_scene("loop", f"pre-tension {tension:g} N, step 1e-4 s", rig, changes=changes)
        step = accepted_step(rig, step_limit(rig.changed(**changes)), 5e-5)
        yield run_scene("loop", f"pre-tension {tension:g} N, step {step:.3g} s", rig, changes=changes, step=step)
    for pitches in (3, 12, 33, 34, 35, 36, 37, 70):
        yield run_scene("loop", f"{pitches} pitches", rig, changes={"chain__pitches": pitches})
    shift = abs(assemble(rig).shift)
    for share in (0.5, 0.999, 1.001, 2.0):
        yield run_scene("loop", f"travel {share:g} of what closes", rig, changes={"tension__travel": share * shift})
    for name, value in (("idler__x", 0.1), ("idler__x", -5.0), ("idler__radius", 1.5), ("tension__direction", 107.0)):
        yield run_scene("loop", f"{name.replace('__', '.')} = {value:g}", rig, changes={name: value})


def states(rig: Rig, depths=(1e-3, 5e-3, 1e-2, 2e-2, 3e-2)) -> Iterator[dict]:
    """Loops let go from where no run would start: deep in a tooth or a ring, on a tip, at almost no speed."""
    family = "initial state"
    for name, wheel in (("sprocket", SPROCKET), ("idler", 1)):
        for depth in depths:

            def pushed(wheel=wheel, depth=depth):
                _, model, state, work = restart(rig, 0.0)
                away = np.array([model.wheels.x[wheel] + 0.55, model.wheels.y[wheel] + 0.2])
                away /= np.hypot(*away)
                model.wheels.x[wheel] += depth * away[0]
                model.wheels.y[wheel] += depth * away[1]
                return march(model, state, work, 0.1)

            yield judged(family, f"{name} pushed {1e3 * depth:g} mm into the chain", pushed)
    for share in (0.05, 0.25, 0.5):

        def turned(share=share):
            _, model, state, work = restart(rig, 0.0)
            state.wheel_angle[SPROCKET] += share * 2 * np.pi / model.tooth.teeth
            return march(model, state, work, 0.1)

        yield judged(family, f"sprocket turned by {share:g} of a pitch under the chain", turned)

    def on_tip():
        _, model, state, work = restart(rig, 0.0)
        orient(state.angle, work.cos, work.sin)
        place(model.chain, state, work)
        arc = int(np.argmin((work.pin_x[:-1] - model.wheels.x[0]) ** 2 + (work.pin_y[:-1] - model.wheels.y[0]) ** 2))
        # the line between two grooves through the centre of an arc
        state.wheel_angle[SPROCKET] = np.arctan2(
            work.pin_y[arc] - model.wheels.y[0], work.pin_x[arc] - model.wheels.x[0]
        )
        return march(model, state, work, 0.1)

    yield judged(family, "an arc exactly at a tooth tip", on_tip)
    for name, value in (("zero", 0.0), ("denormal", 5e-324), ("1e-160", 1e-160), ("denormal, reversed", -5e-324)):

        def crept(value=value):
            _, model, state, work = restart(rig, 0.0)
            for part in (state.rate, state.wheel_rate, state.tooth_impact, state.wheel_impact):
                part[...] = np.abs(value) if part.ndim > 1 or part is state.tooth_impact else value
            state.pin[2:] = value
            return march(model, state, work, 0.05)

        yield judged(family, f"all rates and stored impact velocities {name}", crept)
    yield from laws(rig)
    yield from momentum(rig)


def laws(rig: Rig) -> Iterator[dict]:
    """The laws at the ends of their arguments, the joints of the areas and the symmetry of the groove."""
    family, numbers = "initial state", (0.0, 5e-324, 1e-300, 1e-12, 1.0, 1e6)
    law = build_model(Scene(rig, 0.0)).tooth.law

    def finite():
        values = [
            normal_force(law, depth, sign * rate, max(law.speed_floor, impact), 0.01)
            for depth in numbers for rate in numbers for sign in (-1.0, 1.0) for impact in numbers
        ]  # fmt: skip
        values += [friction_coefficient(law, sign * slip) for slip in numbers for sign in (-1.0, 1.0)]
        return below(
            float(np.sum(~np.isfinite(values))) + float(np.sum(np.array(values[:-12]) < 0)), 0.0, "faulty forces"
        )

    yield judged(family, "normal force and friction from denormal to huge arguments", finite)
    tooth = make_tooth(rig.groove_profile, rig.chain.connector_radius, law)
    depth, tolerance = 1e-4, 1e-9
    groove = rig.groove_profile
    for joint in range(1, 10):

        def continuous(joint=joint):
            """Depth on both sides of the line that two areas share, and on it."""
            on = groove.joints()[joint - 1]
            normal = on - groove.centre[joint - 1]
            normal /= np.hypot(*normal) * (1 if groove.convex[joint - 1] else -1)
            along = np.array([normal[1], -normal[0]])
            centre = on + (tooth.arc_radius - depth) * normal
            seen = [find_area(tooth, *(centre + side * along))[:2] for side in (-1e-10, 0.0, 1e-10)]
            worst = max(abs(found - depth) for _, found in seen)
            return below(worst, tolerance, "jump of the depth in m", at=joint)

        yield judged(family, f"an arc on the line between areas {joint} and {joint + 1}", continuous)

    def mirrored():
        rng = np.random.default_rng(8)
        worst = 0.0
        for x, y in np.column_stack([rng.uniform(1e-6, 0.08, 20000), rng.uniform(0.24, 0.36, 20000)]):
            right, left = find_area(tooth, x, y), find_area(tooth, -x, y)
            areas = 0.0 if right[0] == (11 - left[0] if left[0] else 0) else 1.0
            worst = max(worst, areas, *np.abs(np.array(right[1:]) - np.array(left[1:]) * [1, -1, 1, 1]))
        return below(worst, 1e-12, "asymmetry of area, depth, normal or radius")

    yield judged(family, "20,000 arcs and their mirror images in a groove", mirrored)


def momentum(rig: Rig, pitches=(3, 5, 35, 200)) -> Iterator[dict]:
    """A free loop without gravity: linear and angular momentum stay, to the order of the step.

    Both are those of the bodies after a step; a first-order step moves the bodies before it counts them,
    so that they swing by a turn a step and do not drift.
    """
    for count in pitches:
        for damping in (0.0, 12.4):

            def attempt(count=count, damping=damping):
                free = rig.changed(gravity=0.0, chain__pitches=count, bushing__damping=damping)
                _, model, state, work = restart(free, 210.0, loop="free", ring_radius=None)
                begin = _momentum(model, state, work)
                found = march(model, state, work, 0.2)
                end = _momentum(model, state, work)
                # linear momentum is zero: its scale is that of the bodies' own
                change = max(abs(end[2] / begin[2] - 1), np.hypot(*(end[:2] - begin[:2])) / begin[3])
                bound = MOMENTUM * max(found["turn"], 1e-4)
                return found | below(float(change), bound, "change of momentum", at=count)

            yield judged("momentum", f"free loop of {count} pitches, damping {damping:g}", attempt)


def _momentum(model, state, work):
    """Linear momentum, angular momentum about the origin, and the sum of the bodies' own momenta."""
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    contact_loads(model, state, work)
    mass, vx, vy = model.chain.mass, work.com_vx, work.com_vy
    x = work.pin_x[:-1] + model.chain.com_x * work.cos - model.chain.com_y * work.sin
    y = work.pin_y[:-1] + model.chain.com_x * work.sin + model.chain.com_y * work.cos
    spin = (mass * (x * vy - y * vx) + model.chain.inertia * state.rate).sum()
    return np.array([(mass * vx).sum(), (mass * vy).sum(), spin, (mass * np.hypot(vx, vy)).sum()])
