"""Rest: integrate a loop in chunks and damp its rates at the end of each.

At rest the rates of all bodies, and the unbalanced forces on them as a share of the tension, are small.
"""

from math import inf, pi

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.integrate.run import Integration
from trackdyn.model.arrays import SUSPENSION, Work, make_arrays, make_record
from trackdyn.model.constants import SPROCKET, Drive, Model
from trackdyn.rig.groove import depths_on_sprocket
from trackdyn.rig.layout import Assembly
from trackdyn.scene.build import make_suspensions, preloads
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import elastic_depth
from trackdyn.simulation.loop_arrays import copy_wheels, shift_tensioner

# Length of a chunk, s, and the factor by which every rate is multiplied at its end.
CHUNK, DAMPING = 1e-3, 0.985
# Strands are equalized if the mean tension of two periods of `PERIOD` (s) differs by at most the share `EVEN`; longest
# time for it, s.
PERIOD, EVEN, LONGEST_REST = 0.1, 0.0025, 4.0
# Longest time for bodies that still swing when the strands have equal tension, s.
LONGEST_SWING = 2.0
# Largest rate of a body at rest, rad/s (shipped rigs: 0.03), and largest unbalanced force on it as a share of the
# tension (shipped rigs: 0.0005; a loop that chatters: 1).
SLOW, BALANCED = 0.1, 0.02
# Largest load of an arc at rest over tension plus weight of the chain.
MOST_LOAD = 4.0


class NotSettledError(InputError):
    """Error of a loop that does not come to rest."""


class DampedLoop:
    """Planar chain of an assembly with the sprocket at rest, first without teeth and with the rig's own ring."""

    def __init__(self, scene: Scene, assembly: Assembly, step: float):
        self.scene = scene
        self.shift = assembly.shift  # tensioning wheel along its line, m
        chain = scene.model.chain
        self.weight = chain.gravity * chain.mass.sum() / chain.length.sum()  # a metre of chain, N/m
        # least tension of the strand with the cut joint, N: weight of the chain from its middle to the lowest point
        self.hanging = self.weight * float(assembly.pins[0, 1] - assembly.pins[:, 1].min())
        self.swing = 0.0  # largest rate of a body, rad/s
        model = copy_wheels(scene.model)
        model.wheels.present[SPROCKET] = 1
        model.wheels.radius[SPROCKET] = scene.rig.sprocket.ring_radius
        # at rest, rolling resistance would keep the tensions of the strands different for seconds
        model = model._replace(wheels=model.wheels._replace(rolling=np.zeros_like(model.wheels.rolling)))
        self.model = model._replace(
            drive=Drive(0.0, scene.ramp), step=step, stride=max(round(CHUNK / step), 1), space=None,
            tooth=model.tooth._replace(present=0),
        )  # fmt: skip
        shift_tensioner(self.model, scene.rig, self.shift)
        linearly = METHODS[scene.integrator].linearly_implicit
        method = METHODS["linearly_implicit" if linearly else "semi_implicit"]
        self.state, self.work, self._optional = make_arrays(self.model, method)
        self.state.pin[:2] = assembly.pins[0]
        self.state.angle[:] = assembly.angle
        self.state.wheel_angle[SPROCKET] = assembly.sprocket_angle
        self._begin()

    def _begin(self) -> None:
        self.record = make_record(1, self.state, len(self.model.sensors.body))
        self._samples = Integration(self.work, self._optional)

    def __getstate__(self) -> dict:
        """Return the attributes except the scene, which the caller sets again, and those that `_begin` makes."""
        return {name: value for name, value in vars(self).items() if name not in ("scene", "record", "_samples")}

    def __setstate__(self, state: dict) -> None:
        vars(self).update(state)
        self._begin()

    def tension(self) -> float:
        """Return the tension of the chain at the cut joint, in the middle of the last strand, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    def chunk(self) -> None:
        """Integrate one chunk and damp the rates at its end."""
        self._integrate(self.model)
        self.scale_rates(DAMPING)

    def _integrate(self, model: Model) -> None:
        self._samples(model, self.state, self.record, 0, 1, "settling")

    def scale_rates(self, factor: float) -> None:
        """Multiply every rate by a factor."""
        state = self.state
        state.rate[:] *= factor
        state.pin[2:] *= factor
        state.wheel_rate[:] *= factor
        for name in ("rate", "rate_before"):
            state.suspension[name] *= factor

    def rest(self, seconds: float) -> None:
        """Integrate for a time (s) with damping."""
        for _ in range(round(seconds / CHUNK)):
            self.chunk()

    def engage_teeth(self, seconds: float) -> None:
        """Turn the sprocket to the angle of least penetration, then stiffen its teeth over a time (s)."""
        tooth = self.model.tooth._replace(present=1)
        start = self.state.wheel_angle[SPROCKET]
        # from the angle with a groove under the middle connector to both sides
        candidates = start + 2 * pi / tooth.teeth * np.linspace(-0.5, 0.5, 121)
        candidates = candidates[np.argsort(np.abs(candidates - start), kind="stable")]
        cost = [max(arc_depths(self.scene, self.model, self.work, angle).max(), 0.0) for angle in candidates]
        self.state.wheel_angle[SPROCKET] = candidates[int(np.argmin(cost))]
        self.state.tooth_impact[:] = 0.0
        stiffness = tooth.law.stiffness
        chunks = round(seconds / CHUNK)
        for i in range(chunks):
            law = tooth.law._replace(stiffness=stiffness * 10 ** (-4 * (1 - (i + 1) / chunks)))
            self.model = self.model._replace(tooth=tooth._replace(law=law))
            self.chunk()

    def change_ring(self, radius: float | None) -> None:
        """Change the ring to a radius (m); None shrinks it until it touches no link."""
        rig, wheels = self.scene.rig, self.model.wheels
        start = float(wheels.radius[SPROCKET])
        end = Scene.ring_range(rig)[0] - rig.chain.link_thickness if radius is None else radius
        chunks = round(0.3 / CHUNK)
        for i in range(chunks):
            wheels.radius[SPROCKET] = start + (end - start) * (i + 1) / chunks
            self.chunk()

    def release_suspensions(self) -> None:
        """Release the suspended wheels; springs without a preload in the rig hold them where they are."""
        rig = self.scene.rig
        suspensions = make_suspensions(rig, self.model, self.scene.tension, self.shift)
        slide = np.zeros(len(suspensions.wheel))
        self.model = self.model._replace(
            suspensions=suspensions._replace(preload=preloads(rig, suspensions, self.work, slide))
        )
        self.state = self.state._replace(suspension=np.zeros(len(slide), SUSPENSION))
        self._samples = Integration(self.work, self._optional)
        self.rest(0.4)

    def equalize_strands(self) -> float:
        """Integrate until the strands have equal tension; return its mean, N. Raises as `come_to_rest`."""
        mean = inf
        for _ in range(round(LONGEST_REST / PERIOD)):
            loads = []
            for _ in range(round(PERIOD / CHUNK)):
                self.chunk()
                loads.append(self.tension())
            before, mean = mean, float(np.mean(loads))
            if abs(mean - before) <= EVEN * mean:
                return mean
        self.come_to_rest()
        return mean

    def at_rest(self) -> bool:
        """Take a step; return whether rates and unbalanced forces are below `SLOW` and `BALANCED`."""
        chain, rate = self.model.chain, self.state.rate.copy()
        self._integrate(self.model._replace(stride=1))
        force = chain.mass * chain.length * np.abs(self.state.rate - rate) / self.model.step
        self.swing = float(np.abs(rate).max())
        return self.swing <= SLOW and float(force.max()) <= BALANCED * max(self.tension(), self.hanging)

    def come_to_rest(self) -> bool:
        """Integrate until the loop is at rest; return whether it was at once. Raises `NotSettledError`."""
        if self.at_rest():
            return True
        for _ in range(round(LONGEST_SWING / PERIOD)):
            self.rest(PERIOD)
            if self.at_rest():
                return False
        raise NotSettledError(
            f"the loop does not come to rest: settled in steps of {self.model.step:.3g} s a body still turns at "
            f"{self.swing:.2g} rad/s or alternates; use less tension, softer contacts or heavier bodies"
        )

    def check_meshing(self) -> None:
        """Refuse (`InputError`) a loop at rest with an arc deeper in a tooth than elastic contact explains."""
        if not self.model.tooth.present:
            return
        angle, tension = float(self.state.wheel_angle[SPROCKET]), self.scene.rig.tension.pre_tension
        depth = float(arc_depths(self.scene, self.model, self.work, angle).max())
        if depth > explained_depth(self.model, tension):
            raise InputError(
                f"the chain does not mesh with the sprocket of this rig: at rest an arc lies {1e3 * depth:.3g} mm "
                "inside a tooth; bring sprocket.equal_pitch_radius, groove.seat_depth and ring_radius nearer to each "
                "other"
            )


def arc_depths(scene: Scene, model: Model, work: Work, angle: float) -> np.ndarray:
    """Return the (2 p,) depths (m) of the arcs in the ten-arc groove, the sprocket at ``angle`` (rad); -inf beyond it.

    The contact search (Eqs. 20 to 23) is limited to depths below r_C and would miss an arc deep inside a tooth.
    """
    body, along, wheels = model.shoes.arc_body, model.shoes.arc_x, model.wheels
    centres = np.column_stack([
        work.pin_x[body] + along * work.cos[body] - wheels.x[SPROCKET],
        work.pin_y[body] + along * work.sin[body] - wheels.y[SPROCKET],
    ])  # fmt: skip
    return depths_on_sprocket(scene.rig.groove_profile, scene.rig.chain.connector_radius, centres, angle)


def explained_depth(model: Model, tension: float) -> float:
    """Return the largest depth of elastic contact with a tooth at rest, m, that of an arc under `MOST_LOAD`."""
    tooth = model.tooth
    load = MOST_LOAD * (tension + model.chain.gravity * float(model.chain.mass.sum()))
    widest = float(tooth.radius.max()) + tooth.arc_radius
    return elastic_depth(tooth.law, load, widest)
