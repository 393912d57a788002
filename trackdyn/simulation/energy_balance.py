"""The energy balance of a record: what it leaves open, and whether that shows a step that was too large."""

from math import pi

import numpy as np

from trackdyn.inputs.errors import DivergenceError
from trackdyn.model.arrays import ENERGY_NAMES, KINETIC
from trackdyn.model.constants import Model

# Share of the kinetic energy of the bodies that run round which the path of a method of order 1 misses in a revolution
# of the sprocket, over the angle (rad) of a step: 2.9 to 4.1 in twelve scenes of five rigs from 60 to 1,400 rev/min,
# where it halved with the step and RMS and mean peaks were within 0.3 and 2 % of those at a quarter of it.
PATH = 5.0
# Open rest of the energy balance that is accepted beyond the path of the bodies that run round (`PATH`), as a share of
# the energy exchanged: about four times what the coarsest preset leaves (0.13 % at 0.5 ms, linearly implicit).
OPEN_SHARE = 0.005
# Friction, bearings and bushings may give this share back: rounding and the path of a step.
GAINED_SHARE = 1e-3
# Energy below which shares mean nothing: the chain lifted by a tenth of a millimetre.
NOISE_HEIGHT = 1e-4
LOSSES, STORED = ENERGY_NAMES[1:KINETIC], ENERGY_NAMES[KINETIC:]
# Normal contact gives back what it has stored, some joules of rubber that relaxes after the start; in a record of this
# length (s), in which the loop turns through once, it takes more than that.
NORMAL_LOSSES, LONG_RECORD = ("tooth_normal", "wheel_normal"), 10.0


def passed_pitches(model: Model, seconds: float) -> float:
    """Pitches that come onto the sprocket in so many seconds at the speed that is asked for."""
    return seconds * abs(model.drive.rate) / (2 * pi) * model.tooth.teeth


def open_share(energy, model, seconds: float) -> tuple[float, float]:
    """Open rest of the energy balance over a record as a share of the energy exchanged, and that energy (J).

    Energy exchanged is the sum of all changes in the account (``energy``, (s, 11), ``model.arrays.ENERGY_NAMES``, over
    ``seconds`` from first to last row) and the kinetic energy of the bodies that pass the
    sprocket. The sprocket's work alone would not do: it vanishes where nothing is driven.
    """
    change = energy[-1] - energy[0]
    carried = _turns(model, seconds) * float(energy[:, ENERGY_NAMES.index("kinetic")].max())
    noise = float(model.chain.mass.sum()) * max(model.chain.gravity, 1.0) * NOISE_HEIGHT
    exchanged = max(float(np.abs(change).sum()) + carried, noise)
    return float(change[0] - change[1:].sum()) / exchanged, exchanged


def _turns(model, seconds: float) -> float:
    """How often the whole loop passes the sprocket."""
    return passed_pitches(model, seconds) / len(model.shoes.link_body)


def path_energy(energy, model, seconds: float) -> float:
    """Energy (J) that a step of order 1 may leave open in ``seconds``, however well contacts are resolved."""
    turns = passed_pitches(model, seconds) / model.tooth.teeth
    return PATH * model.step * abs(model.drive.rate) * turns * float(energy[:, ENERGY_NAMES.index("kinetic")].mean())


def check_account(energy, model, seconds: float) -> None:
    """Refuse (`DivergenceError`) a run whose energy balance shows that its step was too large, though nothing diverged.

    Contacts heavier than `scene.step.step_limits` reckons with (a very tight loop, bushings that hardly turn) make
    friction chatter from step to step until it drives what it should brake.
    """
    share, exchanged = open_share(energy, model, seconds)
    remedy = f"use a step smaller than {model.step:g} s"
    accepted = OPEN_SHARE + path_energy(energy, model, seconds) / exchanged
    if not abs(share) <= accepted:
        raise DivergenceError(
            f"{abs(share):.1%} of the energy exchanged in the run is not accounted for, more than {accepted:.1%}: "
            f"the step is too large for the contacts; {remedy}"
        )
    change = energy[-1] - energy[0]
    returned = seconds >= LONG_RECORD and _turns(model, seconds) >= 1.0
    for name in LOSSES:
        gained = -float(change[ENERGY_NAMES.index(name)])
        if gained > GAINED_SHARE * exchanged and (name not in NORMAL_LOSSES or returned):
            raise DivergenceError(
                f"{name.replace('_', ' ')} gave {gained:.3g} J back over the run where it should take energy: contacts "
                f"are heavier than the step limits reckon with and chatter from step to step; {remedy}"
            )


def energy_residual(recording) -> float:
    """Open rest of the energy balance as a share of the sprocket's work over the record.

    Work of the sprocket minus every dissipation minus the change of kinetic, gravitational and bushing energy. The work
    absorbed by normal contact counts as one term: what Eq. 8 stores comes back through it.
    """
    work, *others = recording.energy[-1] - recording.energy[0]
    return float(1.0 - sum(others) / work) if work else float("nan")
