"""Where the studies touch the time loop: a chain settled, moved on, and looked at."""

from copy import deepcopy
from typing import NamedTuple

import numpy as np

from trackdyn.chain.kinematics import orient, place
from trackdyn.contact.loads import contact_loads
from trackdyn.integrate.run import run
from trackdyn.model import Model, Record, State, Work, make_buffers
from trackdyn.scene import Scene, build_model
from trackdyn.settling import diverged, empty_record, settle
from trackdyn.simulate import run_options


class Moving(NamedTuple):
    """A chain in motion, everything that a step needs, and the tensioner's shift (m) that its layout has."""

    model: Model
    state: State
    work: Work
    options: dict
    shift: float

    def with_model(self, **fields) -> "Moving":
        """A copy that moves by itself, with some fields of the model replaced."""
        copy = deepcopy(self)
        return copy._replace(model=copy.model._replace(**fields))

    def with_scene(self, scene: Scene) -> "Moving":
        """A copy that goes on with the step, the integrator and the rig of another scene; its ramp goes on too."""
        model, state = build_model(scene, self.shift), deepcopy(self.state)
        state.steps[0] = round(self.state.steps[0] * self.model.step / scene.step)
        work = make_buffers(len(state.angle), len(model.wheels.x), len(model.shoes.link_body))
        return Moving(model, state, work, run_options(scene, model, state), self.shift)

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return float(self.state.steps[0] * self.model.step)

    def room(self, samples: int, **what) -> Record:
        """An empty record of some samples."""
        loop, bodies = len(self.state.wheel_impact), len(self.state.angle)
        return empty_record(samples, bodies, len(self.model.wheels.x), loop=loop, **what)

    def advance(self, record: Record, stride: int = 1, first: int = 0, last: int | None = None) -> None:
        """Fill samples of a record, of ``stride`` steps each.

        Raises
        ------
        DivergenceError
            A body leaves the physical range: which one, and when.
        """
        last = len(record.gap) if last is None else last
        bad = run(self.model, self.state, self.work, record, first, last, stride, **self.options)
        if bad >= 0:
            raise diverged(bad, self.state, self.model, "the study")

    def pins(self) -> np.ndarray:
        """Pins from that of the first body to the end of the last, (n + 1, 2), m."""
        orient(self.state.angle, self.work.cos, self.work.sin)
        place(self.model.chain, self.state, self.work)
        return np.column_stack([self.work.pin_x, self.work.pin_y])

    def mass_centres(self) -> np.ndarray:
        """Mass centres of the bodies, (n, 2), m."""
        chain, cos, sin = self.model.chain, self.work.cos, self.work.sin
        pins = self.pins()[:-1]
        return pins + np.column_stack([chain.com_x * cos - chain.com_y * sin, chain.com_x * sin + chain.com_y * cos])

    def momentum(self) -> np.ndarray:
        """Linear momentum, angular momentum about the origin, and the sum of the bodies' own momenta."""
        x, y = self.mass_centres().T
        contact_loads(self.model, self.state, self.work)
        px, py = self.model.chain.mass * np.array([self.work.com_vx, self.work.com_vy])
        spin = x * py - y * px + self.model.chain.inertia * self.state.rate
        return np.array([px.sum(), py.sum(), spin.sum(), np.hypot(px, py).sum()])


def settled(scene: Scene) -> Moving:
    """The chain of a scene where its run begins."""
    model, state, work, layout = settle(scene)
    return Moving(model, state, work, run_options(scene, model, state), layout.get("tensioner_shift_m", 0.0))
