"""A step that was tried: a short run, again with half the step, until what is measured holds."""

from typing import NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError
from trackdyn.model.record import END, PEAK, PITCH, SIDE
from trackdyn.scene.limits import round_step, step_limits, turn_limit
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.resolution import NOTICED, alternating_share

HOLDS = 0.01  # of RMS and mean peak, from a step to half of it
SECONDS, RAMP = 1.0, 0.3  # s at speed, and until then
LARGEST, HALVINGS = 1e-4, 4


class Trial(NamedTuple):
    """What came of trying steps on a rig at a speed.

    Attributes
    ----------
    step : float or None
        The largest step tried whose RMS and mean peak stay within a hundredth with half of it, s; None if none did.
    tried : tuple of float
        Steps that ran, s.
    """

    step: float | None
    tried: tuple[float, ...]

    def __str__(self) -> str:
        if self.step is None:
            return (
                f"no step tried holds RMS and mean peak to {HOLDS:.0%} over {SECONDS:g} s: the motion scatters, "
                f"the smallest was {min(self.tried, default=float('nan')):.3g} s"
            )
        return f"--step {self.step:.7g}: tried, RMS and mean peak hold to {HOLDS:.0%} with half of it"


def short_run(loop: Loop, seconds: float, watched: bool = True) -> tuple[np.ndarray, "Recorder"]:
    """RMS of all links (m/s2) and mean peaks of left arcs, right arcs and ring (N) of a record from here on.

    A mean peak is that of the largest forces of all pitches that touch; contacts that are still open count. A run that
    is not ``watched`` goes on where its contacts are not resolved.
    """
    writer = Recorder(loop, seconds, (), 0.0, True, True, watched)
    while not writer.finished:
        writer.chunk()
    of = writer.record.link_mean
    felt = of[:, :, 1] + loop.model.chain.gravity * np.cos(of[:, :, 2])
    still = writer.record.spells.open
    rows = np.vstack([*writer.ended, still[still[:, END] > 0][:, : writer.record.spells.rows.shape[1]]])
    largest = np.zeros((loop.scene.rig.chain.pitches, 3))
    np.maximum.at(largest, (rows[:, PITCH].astype(int), rows[:, SIDE].astype(int)), rows[:, PEAK])
    touched = (largest > 0).sum(axis=0)
    return np.array([np.sqrt((felt**2).mean()), *largest.sum(axis=0) / np.maximum(touched, 1)]), writer


def differs(found: np.ndarray, finer: np.ndarray) -> tuple[float, float]:
    """Relative differences of two answers of `short_run`: of the RMS, and of peaks above a third of the largest."""
    counts = finer[1:] > finer[1:].max() / 3
    peaks = np.abs(found[1:][counts] / finer[1:][counts] - 1)
    return float(abs(found[0] / finer[0] - 1)) if finer[0] else 0.0, float(peaks.max(initial=0.0))


def try_steps(settled: Loop, rpm: float) -> Trial:
    """Halve the step of a run of a second until RMS and mean peak hold to a hundredth.

    Parameters
    ----------
    settled : Loop
        At rest; it stays so.
    rpm : float
        Motor speed, rev/min.
    """
    sample = 1.0 / settled.scene.rig.sensor.rate
    scene = {"motor_rpm": rpm, "ramp": RAMP, "every_link": True, "duration": SECONDS}
    # a scene is judged at the pre-tension, a loop at the tension that it settles at
    tensions = settled.layout["settled_tension_n"], settled.scene.rig.tension.pre_tension
    limits = [limit for tension in tensions for limit in step_limits(settled.model, tension).values()]
    limits += turn_limit(settled.scene.with_(motor_rpm=rpm).sprocket_rate).values()
    step = round_step(min(LARGEST, *limits), sample)
    before, tried = None, []
    for _ in range(HALVINGS + 1):
        try:
            loop = settled.changed(step=step, **scene)
            loop.advance(RAMP)
            found, writer = short_run(loop, SECONDS)
            tried.append(step)
            if before is not None and max(differs(before[0], found)) <= HOLDS and not before[1] > NOTICED:
                return Trial(tried[-2], tuple(tried))
            before = found, alternating_share(writer.alternating, loop.model, writer.record.mean)
        except DivergenceError:
            before = None
        step = round_step(step / 2, sample)
    return Trial(None, tuple(tried))
