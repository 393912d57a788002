"""What a scene needs in memory and time, known before it starts."""

from typing import NamedTuple

import numpy as np
from psutil import virtual_memory

from trackdyn.errors import InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.jit import FOLDER
from trackdyn.model.record import make_record
from trackdyn.model.state import Plane, make_state
from trackdyn.simulation.checkpoint import flat

# Time of a body's step with the Riccati sweep, s, on the machine of the benchmarks; settling takes so many seconds.
BODY_STEP, SETTLING = 1e-7, 2.1
# measures and the file take as much again as the record
COPIES = 2
# floats that a belt keeps of a sample while it is laid
BELT_FLOATS = 160


class Cost(NamedTuple):
    """Bytes of memory, of which ``file`` are written, and seconds of computing, roughly."""

    memory: float
    file: float
    seconds: float

    def __str__(self) -> str:
        return f"about {self.memory / 1e6:.0f} MB of memory, {self.file / 1e6:.0f} MB on disk and {self.seconds:.0f} s"


def cost(scene) -> Cost:
    """What a scene needs."""
    links = scene.rig.chain.pitches if scene.every_link else 0
    samples = scene.duration * scene.rig.sensor.rate
    wheels = 1 + len(scene.rig.rollers) if scene.loop == "on_wheels" else 1
    state = make_state(scene.bodies, 1, wheels)
    if scene.fidelity["space"].setting == "spatial":
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
    rooms = (make_record(count, state, scene.pitches or range(links or 1), links=links) for count in (1, 2))
    one, two = (sum(array.nbytes for array in flat(room).values()) for room in rooms)
    file = samples * (two - one + 8)
    if scene.frame_interval:
        file += scene.duration / scene.frame_interval * (scene.bodies + 4) * 8
    if scene.chain == "belt":
        return Cost(COPIES * file + 8 * BELT_FLOATS * samples, file, 1e-5 * samples)
    tableau = METHODS[scene.integrator].tableau
    steps = (SETTLING + scene.lead_in + scene.ramp + scene.duration) / scene.step * (len(tableau.b) if tableau else 1)
    return Cost(COPIES * file, file, steps * scene.bodies * BODY_STEP)


def refuse_too_large(scene) -> None:
    """Refuse (`InputError`) a scene whose recording does not fit into the memory that is free."""
    memory, free = cost(scene).memory, virtual_memory().available
    if memory > free:
        raise InputError(
            f"scene: duration = {scene.duration:g} s: its recording needs about "
            f"{memory / 1e6:.0f} MB of memory and {free / 1e6:.0f} MB are free; use at most "
            f"{0.9 * scene.duration * free / memory:.3g} s, fewer pitches or a longer frame_interval"
        )


def compiled() -> bool:
    """Whether a time loop was compiled before, from these sources and for this processor."""
    return FOLDER is not None and any(FOLDER.glob("called/integrate_*/run.*.nbc"))
