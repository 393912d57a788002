"""The time step: what is usual, what a tension allows, what divides a sample, and what to try next."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from math import ceil, inf
from typing import TypeVar

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.scene.choices import preset
from trackdyn.scene.limits import step_limits

LEAST_STEP = 1e-8  # s: rounding of the time counts from there on
LEAST_SHARE = 0.01  # of the usual step: nobody waits for less without having asked for it
HALVINGS = 4  # of a step that proves too large
Choice = TypeVar("Choice")
Result = TypeVar("Result")


def round_step(limit: float, sample: float) -> float:
    """A step within a limit that divides the sample interval and has few digits, s: parts that only 2 and 5 divide."""
    parts = max(ceil(sample / max(limit, 1e-9 * sample) * (1 - 1e-9)), 1)
    while 10**12 % parts:
        parts += 1
    return sample / parts


def halved_steps(step: float, sample: float, halvings: int = HALVINGS) -> list[float]:
    """A step and its halves, quarters and so on (s), each rounded to the sample interval."""
    return [round_step(step / 2**k, sample) for k in range(halvings + 1)]


def first_that_runs(
    choices: Sequence[Choice], run: Callable[[Choice], Result], failures: Iterable[type] = (InputError, DivergenceError)
) -> Result:
    """Result of the first choice, such as a step, with which ``run`` raises no failure; the last error if none runs."""
    *first, last = choices
    for choice in first:
        with suppress(*failures):
            return run(choice)
    return run(last)


def usual_step(scene) -> float:
    """Step of the preset ``standard``, or a smaller one that was tried on the rig; it fits the sample interval."""
    step = preset("standard", scene.ring_radius is not None)["step"]
    tried = scene.rig.tried_step(scene.motor_rpm)
    if tried is not None and scene.integrator == "semi_implicit":
        step = min(step, tried.step)
    return round_step(step, 1.0 / scene.rig.rate)


def allowed_step(scene, step: float, tension: float, share: float = 1.0) -> float:
    """A step (s), or what a loop at rest with a tension (N) allows instead: ``share`` of its limit.

    Raises `InputError`: the step is too large and the scene asks for it, or the limit is far below the usual step.
    """
    limits = step_limits(scene.model_of_step(step), tension, METHODS[scene.integrator])
    cause, limit = min(limits.items(), key=lambda item: item[1], default=("", inf))
    if step <= limit:
        return step
    sample = 1.0 / scene.rig.rate
    if scene.step is not None or limit < LEAST_SHARE * step:
        raise InputError(
            f"scene: step = {step!r}: too large for the {cause} at a tension of {tension:.4g} N, a bound that was not "
            f"tried on this rig (trackdyn check tries); {_advice(limit, sample)}"
        )
    return round_step(share * limit, sample)


def _advice(limit: float, sample: float) -> str:
    """The largest step below a limit, in words; no accepted step may be small enough."""
    if limit < LEAST_STEP:
        return (
            f"no step of {LEAST_STEP:g} s or more is small enough; use less tension, softer contacts or heavier bodies"
        )
    return f"must be at most {limit:.2g} s, such as {round_step(limit, sample):.7g} s"
