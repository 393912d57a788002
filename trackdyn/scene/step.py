"""Time step: usual and allowed steps, limits by stability and accuracy, and rounding to the sample interval."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from math import ceil, inf, isinf, pi, sin, sqrt
from typing import TypeVar

import numpy as np

from trackdyn.contact.laws import elastic_force
from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS, Method
from trackdyn.model.constants import Law
from trackdyn.scene.choices import preset

LEAST_STEP = 1e-8  # s: rounding of the time counts from there on
LEAST_SHARE = 0.01  # least allowed share of the usual step: a smaller one is taken only on request
HALVINGS = 4  # times that a step which proves too large is halved
# Largest and least step with which a loop settles, s; the scene's if it is shorter.
SETTLING_STEP, LEAST_SETTLING_STEP = 1e-4, 2e-6
Choice = TypeVar("Choice")
Result = TypeVar("Result")


def round_step(limit: float, sample: float) -> float:
    """Return a step within a limit that divides the sample interval by a product of 2s and 5s, s."""
    pieces = max(ceil(sample / max(limit, 1e-9 * sample) * (1 - 1e-9)), 1)
    while 10**12 % pieces:
        pieces += 1
    return sample / pieces


def halved_steps(step: float, sample: float, halvings: int = HALVINGS) -> list[float]:
    """Return a step and its halves, quarters and so on (s), each rounded to the sample interval."""
    return [round_step(step / 2**k, sample) for k in range(halvings + 1)]


def first_that_runs(
    choices: Sequence[Choice], run: Callable[[Choice], Result], failures: Iterable[type] = (InputError, DivergenceError)
) -> Result:
    """Return the result of the first choice, such as a step, for which ``run`` does not fail; else the last error."""
    *first, last = choices
    for choice in first:
        with suppress(*failures):
            return run(choice)
    return run(last)


def usual_step(scene) -> float:
    """Return the step of the preset ``standard``, or a smaller one tried on the rig, that fits the sample interval."""
    step = preset("standard", scene.ring_radius is not None)["step"]
    tried = scene.rig.tried_step(scene.motor_rpm)
    if tried is not None and scene.integrator == "semi_implicit":
        step = min(step, tried.step)
    return round_step(step, 1.0 / scene.rig.rate)


def allowed_step(scene, step: float, tension: float, share: float = 1.0) -> float:
    """Return a step (s), or ``share`` of the limit at a tension (N), of the tight strand plus the load, if it is less.

    Raises `InputError`: the step is too large and the scene asks for it, or the limit is far below the usual step.
    """
    tension += scene.load
    limits = step_limits(scene.model_of_step(step), tension, METHODS[scene.integrator])
    cause, limit = min(limits.items(), key=lambda item: item[1], default=("", inf))
    if step <= limit:
        return step
    sample = 1.0 / scene.rig.rate
    if scene.step is not None or limit < LEAST_SHARE * step:
        remedy = f"must be at most {limit:.2g} s, such as {round_step(limit, sample):.7g} s"
        if limit < LEAST_STEP:
            other = "use less tension, softer contacts or heavier bodies"
            remedy = f"no step of {LEAST_STEP:g} s or more is small enough; {other}"
        bound = f"at a tension of {tension:.4g} N, a bound that was not tried on this rig (`check` tries)"
        raise InputError(f"scene: step = {step!r}: too large for the {cause} {bound}; {remedy}")
    return round_step(share * limit, sample)


def settling_step(scene, tension: float, longest: float = inf) -> float:
    """Return the step with which a loop settles at a tension (N), s: at most ``longest`` and ``SETTLING_STEP``."""
    step = min(longest, SETTLING_STEP)
    if not METHODS[scene.integrator].linearly_implicit:  # the limit of explicit steps, so that settling does not fail
        step = min(step, max(largest_step(scene.model, tension), LEAST_SETTLING_STEP))
    return round_step(step, 1.0 / scene.rig.rate)


# Load over the static one of a pitch at which stiffness is taken: forces reach 1.6 times the static load with the
# reference ring, only touch-down spikes of less than a millisecond twice. Runs are then stable to about 1.4 times the
# limit, which is computed again at the tension of the settled loop.
DYNAMIC_FACTOR = 2.0
# Beyond this multiple of the step of explicit friction, implicit friction decays with alternating sign.
FRICTION_LEEWAY = 10.0
LEAST_LOAD = 1e-3  # N: a loop without weight and tension touches its wheels, too
MOST_ITERATIONS = 100  # Newton's method takes less than ten


def elastic_depth(law, load, radius):
    """Return the depth (m) at which the elastic term of a law carries a load (N), by Newton's method in logarithms."""
    depth = load / law.stiffness
    for _ in range(MOST_ITERATIONS):
        force, power = elastic_force.py_func(law, depth, radius)
        ratio = (load / force) ** (1.0 / power)
        depth *= ratio
        if abs(ratio - 1.0) < 1e-14:
            break
    return depth


def pitch_load(model, tension: float, radius: float) -> float:
    """Return the load of a pitch (N) on a wheel of a radius (m) around which the chain runs at a tension (N)."""
    pitch = float(model.chain.length.sum()) / len(model.shoes.link_body)
    return 2 * tension * sin(min(pitch / (2 * (radius + model.wheels.half_thickness)), pi / 2))


def _yield_at_end(chain, i: int) -> float:
    """Return the acceleration of an end of body i across its pin line for a unit force there, 1/kg."""
    return 1 / float(chain.mass[i]) + (float(chain.length[i]) / 2) ** 2 / float(chain.inertia[i])


def _stiffness_at(law, load, radius):
    """Return the slope of a law at a load, N/m."""
    depth = elastic_depth(law, load, radius)
    return load / depth * elastic_force.py_func(law, depth, radius)[1]


# Largest rotation of the sprocket in one step of a method of order 1, rad.
LARGEST_TURN = 2.5e-3


def step_limits(model, pre_tension: float, method: Method = METHODS["semi_implicit"]) -> dict[str, float]:
    """Return step limits (s) of a method for a model, by cause; empty if it has none. ``pre_tension`` is in N.

    A contact of stiffness k on a mass m, or the shear stiffness of Dahl's law, oscillates stably for ``h < 2 sqrt(m /
    k)``; friction with the slope c of Eq. 10 decays for ``h < 2 m / c`` (for RK4 2.82 and 2.78 instead of 2). Both are
    taken at ``DYNAMIC_FACTOR`` times the load of one pitch on a wheel, ``2 T sin(pi / m)`` with T the pre-tension plus
    the weight of a metre of chain, more on a wheel smaller than the sprocket. Bushing damping and a compliant cut,
    implicit in semi-implicit Euler, limit RK4 only. Bushing stiffness acts on the smaller rotational inertia.
    """
    limits = turn_limit(model.drive.rate) if method.order == 1 else {}
    oscillation, decay = method.oscillation, method.decay
    # in the plane a staggered method takes friction at the slip after the step (`contact.forces.apply`)
    sliding = FRICTION_LEEWAY if method.staggered and model.space is None else 1.0
    if isinf(oscillation):
        return limits
    chain, tooth, wheels, closure = model.chain, model.tooth, model.wheels, model.closure
    link = float(chain.mass[0])
    at_pin = sum(1 / _yield_at_end(chain, i) for i in (0, 1))  # a force at a pin moves both bodies that meet there
    tension = pre_tension + chain.gravity * float(chain.mass.sum() / chain.length.sum())
    load = max(DYNAMIC_FACTOR * 2 * tension * sin(pi / tooth.teeth), LEAST_LOAD)

    def friction(law, mass, load=load):
        slope = (4 * law.friction_dynamic + 16 / 9 * (law.friction_static - law.friction_dynamic)) * load
        return sliding * decay * mass * law.transition_velocity / slope if slope else inf

    if tooth.present:
        narrow = float((tooth.radius + np.where(tooth.convex, 1, -1) * tooth.arc_radius).min())
        stiffness = _stiffness_at(tooth.law, load, narrow)
        limits["contact stiffness of the teeth (tooth_contact)"] = oscillation * sqrt(at_pin / stiffness)
        limits["friction of the teeth (tooth_contact)"] = friction(tooth.law, at_pin)
    for k in np.flatnonzero(wheels.present):
        name = f"surface of wheel {k}" if k else "ring contact"
        law, radius = Law(*wheels.law[k].tolist()), float(wheels.radius[k])
        # around a wheel that is smaller than the sprocket the chain bends more
        bears = max(DYNAMIC_FACTOR * pitch_load(model, tension, radius), load) if k else load
        limits[f"contact stiffness of the {name}"] = oscillation * sqrt(link / _stiffness_at(law, bears, radius))
        if law.shear_stiffness:
            limits[f"shear stiffness of the {name}"] = oscillation * sqrt(link / law.shear_stiffness)
        else:
            limits[f"friction of the {name}"] = friction(law, link, bears)
    if chain.stiffness:
        # two neighbours turn against each other; each angle feels the bushings at both of its ends, whose
        # Maxwell elements are stiffest when they have no time to relax
        stiffness = chain.stiffness + float(model.maxwell.stiffness.sum())
        limits["stiffness of the bushing"] = oscillation * sqrt(float(min(chain.inertia)) / (4 * stiffness))
    if chain.damping and method.tableau is not None:
        # links and connectors in zigzag, their mass centres at rest: both share the motion of the pin between them
        (a, b), (first, second) = (tuple(float(v) for v in pair[:2]) for pair in (chain.length, chain.inertia))
        mobility = 2 * (a + b) ** 2 / (first * b**2 + second * a**2)
        limits["damping of the bushing"] = decay / (chain.damping * mobility)
    if closure.compliant and method.tableau is not None:
        # the two bodies at the cut, free at their other ends: acceleration of the gap for a unit force through it
        mobility = sum(_yield_at_end(chain, i) for i in (0, -1))
        limits["stiffness of the cut (closure)"] = oscillation / sqrt(closure.stiffness * mobility)
        if closure.damping:
            limits["damping of the cut (closure)"] = decay / (closure.damping * mobility)
    return limits


def largest_step(model, *tensions: float) -> float:
    """Return the least of the explicit step limits (`step_limits`) at some tensions (N), s; infinite if none."""
    return min((limit for tension in tensions for limit in step_limits(model, tension).values()), default=inf)


def turn_limit(rate: float) -> dict[str, float]:
    """Return the step limit of a method of order 1 at the sprocket's ``rate`` (rad/s): accuracy, not stability."""
    return {"turn of the sprocket (motor_rpm)": LARGEST_TURN / abs(rate)} if rate else {}
