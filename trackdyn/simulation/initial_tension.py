"""Pre-tension: the tensioning wheel moves until the strand onto the sprocket has the target tension at rest.

`TensionedLoop.tighten` approaches the target; if that is close to the weight of the strand, the loop starts taut and
`TensionedLoop.slacken` lets it out; `TensionedLoop.set_tension` takes secant steps between states at rest. The loop is
integrated in chunks, and its rates are damped at the end of each.
"""

from functools import cached_property
from math import inf, pi

import numpy as np

from trackdyn.chain.kinematics import on_pin_line
from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.integrate.run import Integration
from trackdyn.model.arrays import SUSPENSION, Record, Work, make_arrays, make_record
from trackdyn.model.constants import SPROCKET, Drive, Model
from trackdyn.rig.groove import depths_on_sprocket
from trackdyn.rig.layout import assemble, travel_range
from trackdyn.scene.build import make_suspensions, preloads
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import elastic_depth, settling_step
from trackdyn.simulation.loop_arrays import copy_wheels, shift_tensioner

CHUNK, DAMPING = 1e-3, 0.985  # length of a chunk, s, and the factor by which every rate is multiplied at its end
# Strands are equalized if the mean tension of two periods of `PERIOD` (s) differs by at most the share `EVEN`; longest
# time for it, s.
PERIOD, EVEN, LONGEST_REST = 0.1, 0.0025, 4.0
LONGEST_SWING = 2.0  # longest time for bodies that still swing when the strands have equal tension, s
# Largest rate of a body at rest, rad/s (shipped rigs: 0.03), and largest unbalanced force on it as a share of the
# tension (shipped rigs: 0.0005; a loop that chatters: 1).
SLOW, BALANCED = 0.1, 0.02
MOST_LOAD = 4.0  # largest load of an arc at rest over tension plus weight of the chain
TENSIONER_TIME = 0.15  # time constant of the tensioner, s; strands swing faster
TOLERANCE, MOST_SECANT_STEPS = 0.0075, 12  # of the tension at rest, a share (1 % is promised)
CONTACT_COMPLIANCE = 1e-6  # of the contacts of a loop on its wheels, m/N: bounds the stiffness of a taut loop
# Tension of a taut strand over the weight that hangs below it; a target below the second ratio needs slackening.
TAUT, SLACK = 10.0, 1.5
FALL = 0.15  # share by which a secant step lowers the tension of a taut chain, over at most an eighth of the travel


class NotSettledError(InputError):
    """Error of a loop that does not come to rest."""


def tensioned(scene: Scene, divisor: float) -> "TensionedLoop":
    """Return the tensioned loop of a scene on the rig's own ring, its step divided by ``divisor``, or `InputError`."""
    loop = TensionedLoop(scene, divisor)
    if loop.target > SLACK * loop.hanging:
        try:
            loop.tighten()
            if loop.set_tension():
                return loop
            if loop.reached < loop.target:
                raise loop.refusal()
        except (DivergenceError, NotSettledError):
            if loop.target > TAUT * loop.hanging:
                raise
    loop = TensionedLoop(scene, divisor, TAUT * loop.hanging)
    loop.slacken()
    if not loop.set_tension():
        raise loop.refusal()
    return loop


class TensionedLoop:
    """Planar chain with the sprocket at rest, and its target tension: ``taut`` (N), or the rig's pre-tension.

    It begins without teeth, with the rig's own ring; ``divisor`` divides its step.
    """

    def __init__(self, scene: Scene, divisor: float = 1, taut: float | None = None):
        rig, chain = scene.rig, scene.model.chain
        assembly = assemble(rig, chain.length)
        self.low, self.high = travel_range(rig, assembly.shift)
        # target tension, N; metres of chain per metre of shift
        self.target, self.lever = taut or rig.tension.pre_tension, assembly.lever
        step = settling_step(scene, self.target, inf if taut else scene.time_step) / divisor
        self.scene, self.shift = scene, assembly.shift  # tensioning wheel along its line, m
        weight = chain.gravity * chain.mass.sum() / chain.length.sum()  # a metre of chain, N/m
        # least tension of the strand with the cut joint, N: weight of the chain from its middle to the lowest point
        self.hanging = weight * float(assembly.pins[0, 1] - assembly.pins[:, 1].min())
        self.swing = 0.0  # largest rate of a body, rad/s
        model = copy_wheels(scene.model)
        model.wheels.present[SPROCKET] = 1
        model.wheels.radius[SPROCKET] = rig.sprocket.ring_radius
        self.model = model._replace(
            drive=Drive(0.0, scene.ramp), step=step, stride=max(round(CHUNK / step), 1), space=None,
            tooth=model.tooth._replace(present=0),
            # at rest, rolling resistance would keep the tensions of the strands different for seconds
            wheels=model.wheels._replace(rolling=np.zeros_like(model.wheels.rolling)),
        )  # fmt: skip
        shift_tensioner(self.model, rig, self.shift)
        linearly = METHODS[scene.integrator].linearly_implicit
        method = METHODS["linearly_implicit" if linearly else "semi_implicit"]
        self.state, self.work, self._optional = make_arrays(self.model, method)
        self.state.pin[:2] = assembly.pins[0]
        self.state.angle[:] = assembly.angle
        self.state.wheel_angle[SPROCKET] = assembly.sprocket_angle
        # the ring with which the tension is set, m; without teeth a chain needs one
        self.reference = rig.ring_radius if scene.model.tooth.present else rig.sprocket.ring_radius
        # tension at rest, N; shift of the wheel over that of `_shift_for` (initial value from the shipped rigs)
        self.reached, self.compliance_ratio = 0.0, 1.6
        # the compliance of a slack strand is too large: no shift of a chunk is longer than a tenth of a body
        self.longest_shift = 0.1 * float(chain.length.max())
        self.sag = assembly.path.sag(weight)

    @cached_property
    def _samples(self) -> tuple[Integration, Record]:
        return Integration(self.work, self._optional), make_record(1, self.state, len(self.model.sensors.body))

    def __getstate__(self) -> dict:
        """Return the attributes except the scene, which the caller sets again, and those that are made anew."""
        return {name: value for name, value in vars(self).items() if name not in ("scene", "_samples")}

    def tension(self) -> float:
        """Return the tension of the chain at the cut joint, in the middle of the last strand, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    def chunk(self) -> float:
        """Integrate one chunk, damp the rates at its end, and return the `tension`."""
        self._integrate(self.model)
        self.scale_rates(DAMPING)
        return self.tension()

    def _integrate(self, model: Model) -> None:
        integrate, record = self._samples
        integrate(model, self.state, record, 0, 1, "settling")

    def scale_rates(self, factor: float) -> None:
        """Multiply every rate by a factor."""
        state = self.state
        state.rate[:] *= factor
        state.pin[2:] *= factor
        state.wheel_rate[:] *= factor
        state.suspension["rate"] *= factor
        state.suspension["rate_before"] *= factor

    def rest(self, seconds: float) -> None:
        """Integrate for a time (s) with damping."""
        for _ in range(round(seconds / CHUNK)):
            self.chunk()

    def engage_teeth(self, seconds: float) -> None:
        """Turn the sprocket to the angle of least penetration, then stiffen its teeth over a time (s)."""
        tooth = self.model.tooth._replace(present=1)
        # from the angle with a groove under the middle connector to both sides
        start = self.state.wheel_angle[SPROCKET]
        candidates = start + 2 * pi / tooth.teeth * np.linspace(-0.5, 0.5, 121)
        candidates = candidates[np.argsort(np.abs(candidates - start), kind="stable")]
        cost = [max(arc_depths(self.scene, self.model, self.work, angle).max(), 0.0) for angle in candidates]
        self.state.wheel_angle[SPROCKET] = candidates[int(np.argmin(cost))]
        self.state.tooth_impact[:] = 0.0
        chunks = round(seconds / CHUNK)
        for i in range(chunks):
            law = tooth.law._replace(stiffness=tooth.law.stiffness * 10 ** (-4 * (1 - (i + 1) / chunks)))
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
        suspensions = suspensions._replace(preload=preloads(rig, suspensions, self.work))
        self.model = self.model._replace(suspensions=suspensions)
        self.state = self.state._replace(suspension=np.zeros(len(suspensions.wheel), SUSPENSION))
        vars(self).pop("_samples", None)
        self.rest(0.4)

    def equalize_strands(self) -> float:
        """Integrate until the strands have equal tension; return its mean, N. Raises as `come_to_rest`."""
        mean = inf
        for _ in range(round(LONGEST_REST / PERIOD)):
            before, mean = mean, float(np.mean([self.chunk() for _ in range(round(PERIOD / CHUNK))]))
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

    def _shift_for(self, tension: float) -> float:
        """Return the shift of the wheel (m) for a tension (N), up to a constant."""
        tension = max(tension, 0.1 * self.target, 0.1 * self.hanging, 1e-6)
        return (CONTACT_COMPLIANCE * tension - self.sag / tension**2) / self.lever

    def _shift(self, shift: float) -> float:
        """Shift the tensioning wheel (m) within its travel, integrate a chunk, and return the actual shift."""
        before, longest = self.shift, self.longest_shift
        self.shift = min(max(before + min(max(shift, -longest), longest), self.low), self.high)
        shift_tensioner(self.model, self.scene.rig, self.shift)
        self.chunk()
        return self.shift - before

    def follow_tension(self, seconds: float) -> None:
        """Move the tensioning wheel towards the target tension for a time, s."""
        mean = self.tension() or self.target
        for _ in range(round(seconds / CHUNK)):
            mean += 0.1 * (self.tension() - mean)
            tension = max(mean, 0.1 * self.target, 50.0)
            compliance = 2 * self.sag / tension**3 + CONTACT_COMPLIANCE
            self._shift((self.target - mean) * compliance / self.lever * CHUNK / TENSIONER_TIME)

    def tighten(self) -> None:
        """Approach the target tension, first without teeth, then with the ring and the suspensions of the rig."""
        self.follow_tension(0.4)
        if self.scene.model.tooth.present:
            self.engage_teeth(0.2)
        self.follow_tension(0.6)
        if self.reference is None:
            self.change_ring(None)
        if self.scene.tension != "sprung" and any(wheel.suspension for wheel in self.scene.rig.wheels.values()):
            self.release_suspensions()

    def slacken(self) -> None:
        """Let a taut chain out until its tension is below the rig's pre-tension; `InputError`: it stays above."""
        self.tighten()
        self.reached, self.target = self.equalize_strands(), self.scene.rig.tension.pre_tension
        least, rising, moves = (inf, self.shift), 0, True
        while self.reached > self.target:
            rising = 0 if self.reached < least[0] else rising + 1
            least = min(least, (self.reached, self.shift))
            if not moves or rising == 3:  # at the end of the travel, or a longer strand weighs more
                self.come_to_rest()
                raise self.refusal(least)
            moves = self.secant_step((1 - FALL) * self.reached, (self.high - self.low) / 8)

    def secant_step(self, tension: float, longest: float) -> bool:
        """Take a secant step (at most ``longest`` m) towards a tension (N); return whether the wheel moved."""
        target = self.compliance_ratio * (self._shift_for(tension) - self._shift_for(self.reached))
        chunks = round(0.5 * PERIOD / CHUNK)
        small = min(max(target, -longest), longest) / chunks
        shift = sum(self._shift(small) for _ in range(chunks))
        before, self.reached = self.reached, self.equalize_strands()
        expected = self._shift_for(self.reached) - self._shift_for(before)
        ratio = shift / expected / self.compliance_ratio if shift * expected > 0 else None
        self.compliance_ratio *= 2.0 if ratio is None else min(max(ratio, 0.25), 4.0)
        return shift != 0.0

    def set_tension(self) -> bool:
        """Move the wheel until the strand has the target tension at rest; return whether it does."""
        self.reached = self.equalize_strands()
        for _ in range(MOST_SECANT_STEPS):
            if abs(self.reached - self.target) <= TOLERANCE * self.target:
                if self.come_to_rest():
                    return True
                self.reached = self.equalize_strands()
            elif not self.secant_step(self.target, self.longest_shift):
                break
        self.come_to_rest()
        return False

    def refusal(self, least: tuple[float, float] | None = None) -> InputError:
        """Return the error of a pre-tension above the largest tension of the strand, or its ``least`` (N; shift, m)."""
        tension, travel = self.scene.rig.tension, 1e3 * self.scene.rig.tension.travel
        reached, shift = least or (self.reached, self.shift)
        low, high = 1e3 * self.low, 1e3 * self.high
        position = f"with the {tension.wheel} shifted by {1e3 * shift:.4g} mm of tension.travel = {travel:.4g} mm"
        if min(-low, high) < travel:
            position += f" ({low:.4g} to {high:.4g} mm until it overlaps another wheel)"
        if least:
            problem = f"must exceed {reached:.4g} N, the least tension of the strand onto the sprocket, {position}; "
            problem += f"{self.hanging:.4g} N of chain hang below it"
        else:
            problem = f"cannot be reached; the strand has {reached:.4g} N {position}; "
            problem += "change the pre-tension, enlarge the travel or move the wheels"
        return InputError(f"tension.pre_tension = {tension.pre_tension:g} N: {problem}")

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
    x, y = on_pin_line.py_func(work, model.shoes.arc_body, model.shoes.arc_x)
    centres = np.column_stack([x - model.wheels.x[SPROCKET], y - model.wheels.y[SPROCKET]])
    return depths_on_sprocket(scene.rig.groove_profile, scene.rig.chain.connector_radius, centres, angle)


def explained_depth(model: Model, tension: float) -> float:
    """Return the largest depth of elastic contact with a tooth at rest, m, that of an arc under `MOST_LOAD`."""
    load = MOST_LOAD * (tension + model.chain.gravity * float(model.chain.mass.sum()))
    return elastic_depth(model.tooth.law, load, float(model.tooth.radius.max()) + model.tooth.arc_radius)
