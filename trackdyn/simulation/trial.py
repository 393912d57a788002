"""A step that was tried: a short run, again with half the step, until what is measured holds."""

from typing import NamedTuple

from trackdyn.errors import DivergenceError
from trackdyn.scene.limits import largest_step, round_step, turn_limit
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.resolution import NO

HOLDS = 0.01  # of RMS and mean peak, from a step to half of it
SECONDS, RAMP = 1.0, 0.3  # s at speed, and until then
LARGEST, HALVINGS = 1e-4, 4


class Trial(NamedTuple):
    """What came of trying steps on a rig at a speed."""

    # the largest step tried whose RMS and mean peak stay within a hundredth with half of it, s; None if none did
    step: float | None
    tried: tuple[float, ...]  # steps that ran, s

    def __str__(self) -> str:
        if self.step is None:
            return (
                f"no step tried holds RMS and mean peak to {HOLDS:.0%} over {SECONDS:g} s: the motion scatters, "
                f"the smallest was {min(self.tried, default=float('nan')):.3g} s"
            )
        return f"--step {self.step:.7g}: tried, RMS and mean peak hold to {HOLDS:.0%} with half of it"


def try_steps(settled: Loop, rpm: float) -> Trial:
    """Halve the step of a second's run at ``rpm`` (rev/min) from rest until RMS and mean peak hold to a hundredth."""
    sample = 1.0 / settled.scene.rig.sensor.rate
    scene = {"motor_rpm": rpm, "ramp": RAMP, "every_link": True, "duration": SECONDS}
    # a scene is judged at the pre-tension, a loop at the tension that it settles at
    tensions = settled.layout["settled_tension_n"], settled.scene.rig.tension.pre_tension
    turn = turn_limit(settled.scene.with_(motor_rpm=rpm).sprocket_rate).values()
    step = round_step(min(LARGEST, largest_step(settled.model, *tensions), *turn), sample)
    before, tried = None, []
    for _ in range(HALVINGS + 1):
        try:
            loop = settled.changed(step=step, **scene)
            loop.advance(RAMP)
            writer = Recorder(loop, SECONDS, (), 0.0, True, True, False).finish()
            found = writer.answer()
            tried.append(step)
            if before is not None and max(before[0].differs(found)) <= HOLDS and before[1] != NO:
                return Trial(tried[-2], tuple(tried))
            before = found, writer.watch.resolution().state
        except DivergenceError:
            before = None
        step = round_step(step / 2, sample)
    return Trial(None, tuple(tried))
