"""Pre-tension: the tensioning wheel moves until the strand onto the sprocket has the target tension at rest.

1. `TensionedLoop.tighten`: the wheel follows the mean tension, first without teeth, then with them, with the ring and
   the suspensions of the rig.
2. `TensionedLoop.slacken`, for a target close to the weight of the strand: the loop starts taut and is let out in
   secant steps until the tension is below the target.
3. `TensionedLoop.set_tension`: secant steps between states at rest until the target is reached.
"""

from math import inf

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.rig.layout import assemble, travel_range
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import settling_step
from trackdyn.simulation.loop_arrays import shift_tensioner
from trackdyn.simulation.rest_state import CHUNK, PERIOD, DampedLoop, NotSettledError

TENSIONER_TIME = 0.15  # time constant of the tensioner, s; strands swing faster
# Tolerance of the tension at rest, a share (1 % is promised), and largest number of secant steps.
TOLERANCE, MOST_SECANT_STEPS = 0.0075, 12
# Compliance of the contacts of a loop on its wheels, m/N: bounds the stiffness of a taut loop.
CONTACT_COMPLIANCE = 1e-6
# Tension of a taut strand over the weight that hangs below it; a target below the second ratio needs slackening.
TAUT, SLACK = 10.0, 1.5
# Share by which a secant step lowers the tension of a taut chain, over at most an eighth of the travel.
FALL = 0.15


def tensioned(scene: Scene, divisor: float) -> "TensionedLoop":
    """Return the loop of a scene tensioned on the rig's own ring, its step divided by ``divisor``.

    Raises `InputError`: the tension cannot be reached, or the loop does not come to rest.
    """
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


class TensionedLoop(DampedLoop):
    """Damped loop with a target tension: ``taut`` (N), or the rig's pre-tension; its step is divided by ``divisor``."""

    def __init__(self, scene: Scene, divisor: float = 1, taut: float | None = None):
        rig, length = scene.rig, scene.model.chain.length
        assembly = assemble(rig, length)
        self.low, self.high = travel_range(rig, assembly.shift)
        # target tension, N; metres of chain per metre of shift
        self.target, self.lever = taut or rig.tension.pre_tension, assembly.lever
        step = settling_step(scene, self.target, inf if taut else scene.time_step) / divisor
        super().__init__(scene, assembly, step)
        # the ring with which the tension is set, m; without teeth a chain needs one
        self.reference = rig.ring_radius if scene.model.tooth.present else rig.sprocket.ring_radius
        # tension at rest, N; shift of the wheel over that of `_shift_for` (initial value from the shipped rigs)
        self.reached, self.compliance_ratio = 0.0, 1.6
        # the compliance of a slack strand is too large: no shift of a chunk is longer than a tenth of a body
        self.longest_shift = 0.1 * float(length.max())
        self.sag = assembly.path.sag(self.weight)

    def _shift_for(self, tension: float) -> float:
        """Return the shift of the wheel (m) for a tension (N), up to a constant."""
        tension = max(tension, 0.1 * self.target, 0.1 * self.hanging, 1e-6)
        return (CONTACT_COMPLIANCE * tension - self.sag / tension**2) / self.lever

    def _shift(self, shift: float) -> float:
        """Shift the tensioning wheel (m) within its travel, integrate a chunk, and return the actual shift."""
        before = self.shift
        longest = self.longest_shift
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
        """Move the wheel until the strand has the target tension at rest; return whether it does.

        Raises as `come_to_rest`.
        """
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
        """Return the error of a pre-tension that is not reached; ``least``: the tension (N) and shift (m) it exceeds.

        Without ``least`` the pre-tension is above the largest tension of the strand.
        """
        tension, travel = self.scene.rig.tension, 1e3 * self.scene.rig.tension.travel
        reached, shift = least or (self.reached, self.shift)
        low, high = 1e3 * self.low, 1e3 * self.high
        position = f"with the {tension.wheel} shifted by {1e3 * shift:.4g} mm of tension.travel = {travel:.4g} mm"
        if max(-low, high) < travel or min(-low, high) < travel:
            position += f" ({low:.4g} to {high:.4g} mm until it overlaps another wheel)"
        if least:
            return InputError(
                f"tension.pre_tension = {tension.pre_tension:g} N: must exceed {reached:.4g} N, the least tension of "
                f"the strand onto the sprocket, {position}; {self.hanging:.4g} N of chain hang below it"
            )
        return InputError(
            f"tension.pre_tension = {tension.pre_tension:g} N: cannot be reached; the strand has {reached:.4g} N "
            f"{position}; change the pre-tension, enlarge the travel or move the wheels"
        )
