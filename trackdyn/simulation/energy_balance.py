"""Energy balance of a record: its residual, and the check of the step by it."""

from math import pi

import numpy as np

from trackdyn.inputs.errors import DivergenceError
from trackdyn.model.arrays import ENERGY_NAMES, KINETIC
from trackdyn.model.constants import Model

# Error of a method of order 1 on curved paths: share of the kinetic energy that it misses in a revolution of the
# sprocket, over the angle (rad) of a step. 2.9 to 4.1 in twelve scenes of five rigs from 60 to 1,400 rev/min, where it
# halved with the step and RMS and mean peaks were within 0.3 and 2 % of those at a quarter of it.
PATH_ERROR = 5.0
# Largest residual beyond `PATH_ERROR`, as a share of the energy exchanged: about four times that of the coarsest preset
# (0.13 % at 0.5 ms, linearly implicit).
LARGEST_RESIDUAL = 0.005
LARGEST_GAIN = 1e-3  # share that friction, bearings and bushings may return: rounding and `PATH_ERROR`
NOISE_HEIGHT = 1e-4  # m by which the chain is lifted with the energy below which shares are noise
LOSSES = ENERGY_NAMES[1:KINETIC]
# Normal contact returns the energy that it stored, some joules of rubber that relaxes after the start; in a record of
# this length (s), in which the loop turns once, it dissipates more than that.
NORMAL_LOSSES, LONG_RECORD = ("tooth_normal", "wheel_normal"), 10.0


def passed_pitches(model: Model, seconds: float) -> float:
    """Return the number of pitches that come onto the sprocket in ``seconds`` at the nominal speed."""
    return seconds * abs(model.drive.rate) / (2 * pi) * model.tooth.teeth


def open_share(energy, model, seconds: float) -> tuple[float, float]:
    """Return the residual of the energy balance as a share of the energy exchanged, and that energy (J).

    ``energy`` (s, 11; `ENERGY_NAMES`) covers ``seconds``. The energy exchanged is the sum of all changes and of the
    kinetic energy of the bodies that pass the sprocket, for the sprocket's work vanishes at rest.
    """
    change, turns = energy[-1] - energy[0], passed_pitches(model, seconds) / len(model.shoes.link_body)
    carried = turns * float(energy[:, KINETIC].max())
    noise = float(model.chain.mass.sum()) * max(model.chain.gravity, 1.0) * NOISE_HEIGHT
    exchanged = max(float(np.abs(change).sum()) + carried, noise)
    return float(change[0] - change[1:].sum()) / exchanged, exchanged


def path_error(energy, model, seconds: float) -> float:
    """Return the residual (J) that a step of order 1 may leave in ``seconds`` although contacts are resolved."""
    turns = passed_pitches(model, seconds) / model.tooth.teeth
    return PATH_ERROR * model.step * abs(model.drive.rate) * turns * float(energy[:, KINETIC].mean())


def check_energy_balance(energy, model, seconds: float) -> None:
    """Refuse (`DivergenceError`) a run whose energy balance shows that its step was too large."""
    share, exchanged = open_share(energy, model, seconds)
    remedy = f"use a step smaller than {model.step:g} s"
    accepted = LARGEST_RESIDUAL + path_error(energy, model, seconds) / exchanged
    if not abs(share) <= accepted:
        raise DivergenceError(
            f"the energy balance of the run has a residual of {abs(share):.1%} of the energy exchanged, more than "
            f"{accepted:.1%}: the step is too large for the contacts; {remedy}"
        )
    change = energy[-1] - energy[0]
    returned = seconds >= LONG_RECORD and passed_pitches(model, seconds) >= len(model.shoes.link_body)
    for name in LOSSES:
        gained = -float(change[ENERGY_NAMES.index(name)])
        if gained > LARGEST_GAIN * exchanged and (name not in NORMAL_LOSSES or returned):
            raise DivergenceError(
                f"{name.replace('_', ' ')} returned {gained:.3g} J over the run where it should dissipate energy: "
                f"contact forces exceed those of the step limits, and contacts chatter from step to step; {remedy}"
            )


def energy_residual(recording) -> float:
    """Return the residual of the energy balance as a share of the sprocket's work over the record."""
    work, *others = recording.energy[-1] - recording.energy[0]
    return float(1.0 - sum(others) / work) if work else float("nan")
