"""Is the motion of a record resolved by its step? Judged from what alternates from step to step, and while it runs.

Where a contact is too stiff for the step, forces flip from one step to the next. All bodies are looked at
(`integrate.run`), so that a few pitches on the sprocket tell what one sensor's link shows after a turn of the loop.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError
from trackdyn.model.constants import Model

# What alternates, as a share of the mean square that the sensor reads. Set on a pilot (docs/choosing-a-fidelity.md) in
# which no run below ``MOST`` was 2 % off in RMS, and nearly all above it were off in RMS or peaks.
MOST, NOTICED = 1.0, 0.1
# Pitches that must have come onto the sprocket before a record can count as resolved, and looks that must have been
# taken; one pitch shows enough of a record that is not, for it is no longer the first impact.
LEAST_PITCHES, LEAST_LOOKS = 3.0, 10
YES, NO, OPEN = "yes", "no", "not judged"


class Resolution(NamedTuple):
    """What is known of the resolution of a record.

    Attributes
    ----------
    state : str
        ``yes``; ``no``: what alternates is more than ``NOTICED`` of what the sensor reads; ``not judged``.
    share : float
        What alternates as a share of the mean square that the sensor reads; NaN if it was not looked at.
    reason : str
        A sentence; empty for ``yes``.
    """

    state: str
    share: float
    reason: str


def alternating_share(alternating, model: Model, mean) -> float:
    """What alternates from step to step as a share of the mean square that the sensor reads.

    Parameters
    ----------
    alternating : (2,) array
        Sums over a record (`model.work.Work`).
    model : Model
        What ran.
    mean : (s, 3) array
        Of the record (`recording.Recording`).
    """
    found, looks = alternating
    if not looks or not len(mean):
        return float("nan")
    gravity = float(model.chain.gravity)
    read = float(((mean[:, 1] + gravity * np.cos(mean[:, 2])) ** 2).mean())
    # without gravity and motion there is rounding alone
    return float(found / looks / model.step**2 / max(read, 1e-6))


def passed_pitches(model: Model, seconds: float) -> float:
    """Pitches that come onto the sprocket in so many seconds at the speed that is driven."""
    return seconds * abs(model.drive.rate) / (2 * pi) * model.tooth.teeth


def resolution(alternating, model: Model, mean, seconds: float) -> Resolution:
    """State of the resolution of a record; see `alternating_share` for the parameters."""
    share = alternating_share(alternating, model, mean)
    if not alternating[1]:
        return Resolution(OPEN, share, "steps of this integrator are not watched")
    if len(model.wheels.x) < 2:
        return Resolution(YES, share, "")  # a free loop touches nothing
    pitches = passed_pitches(model, seconds)
    if share > NOTICED and _seen(alternating, pitches):
        return Resolution(
            NO, share,
            f"contacts are hardly resolved: what flips from step to step is {share:.2g} of the mean square that the "
            f"sensor reads, more than {NOTICED:g}; compare with a step smaller than {model.step:g} s",
        )  # fmt: skip
    if pitches < LEAST_PITCHES or alternating[1] < LEAST_LOOKS:
        return Resolution(
            OPEN, share,
            f"{pitches:.2g} pitches came onto the sprocket, too few to tell whether contacts are resolved; "
            f"{LEAST_PITCHES:g} are needed",
        )  # fmt: skip
    return Resolution(YES, share, "")


def _seen(alternating, pitches: float) -> bool:
    """Enough was seen to find a fault."""
    return pitches >= 1.0 and alternating[1] >= LEAST_LOOKS


def refuse_unresolved(alternating, model: Model, mean, seconds: float) -> None:
    """Refuse a record whose contacts flip from step to step; parameters as in `resolution`.

    The account of work closes by construction and does not see that; means over samples hide it.

    Raises
    ------
    DivergenceError
        Says how much alternates.
    """
    share = alternating_share(alternating, model, mean)
    if share > MOST and _seen(alternating, passed_pitches(model, seconds)):
        raise DivergenceError(
            f"contacts are not resolved: after {seconds:.3g} s what flips from step to step is {share:.3g} times the "
            f"mean square that the sensor reads; a step smaller than {model.step:g} s would do, trackdyn check tries it"
        )
