"""Is a record resolved by its step? Its contacts are looked at while it runs, and a doubtful piece is run again.

Where a contact is too stiff for the step, its force flips from one step to the next. All bodies are looked at
(`integrate.run`), so that a few pitches on the sprocket tell what one sensor's link shows after a turn of the loop. A
peak force that lasts one step is not resolved, either (`integrate.contact_log`), and a record shorter than a turn of
the loop is doubtful for its length. None of this says how wrong a record is: a run with a finer step does
(`StepCheck`). All who compare two steps of a run take the bounds of this module. The energy balance shows a step that
was too large, too (`energy_balance.check_account`).
"""

from collections.abc import Callable
from math import isnan, nan
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import SIDES, Record
from trackdyn.model.constants import Model
from trackdyn.simulation.readings import specific_force

# Most that RMS and mean peak may differ with a finer step; half of it counts as resolved.
RMS, PEAKS = 0.02, 0.05
# As much of both where a step is recommended for all runs of a rig (`rig_check`): half of ``RMS``, since it was tried
# at one speed for a second.
RECOMMENDED = 0.01
# Alternating share that is suspect. Set on a pilot (docs/speed-and-accuracy.md), no run of which that stayed below it
# was 2 % off in RMS.
NOTICED = 0.01
# Most that may alternate, as a share of the mean square of single steps (``Recording.raw``): ``RMS`` of theirs.
FLIPS = 2 * RMS
# Share of the mean peak in peaks that stand for one step, with a neighbour below half: the true one may be as much as
# twice as large, so that a tenth of the mean peak may be half off, which is ``PEAKS``.
ONE_STEP = 0.1
LEAST_LOOKS = 10  # samples before a verdict
# Pitches that must have come onto the sprocket before a record can count as resolved; one pitch shows enough of a
# record that is not, for it is no longer the first impact.
LEAST_PITCHES = 3.0
YES, NO, OPEN = "yes", "no", "not judged"


class Resolution(NamedTuple):
    """Whether a record is resolved by its step, and why."""

    # ``yes``; ``no``: doubtful, and beyond half of ``RMS`` or ``PEAKS`` with a finer step, or more than ``FLIPS``
    # alternates; ``not judged``
    state: str = OPEN
    share: float | None = None  # `Alternation.share`
    reason: str = ""  # a sentence; empty for ``yes``


class Difference(NamedTuple):
    """Largest relative differences from a run with a finer step; NaN where none was tried."""

    rms: float  # relative difference of RMS
    peaks: float  # relative difference of mean peaks on sides that carry

    def within(self, rms: float = RMS, peaks: float = PEAKS) -> bool:
        """Whether both are within bounds, which are those of this module or stricter ones."""
        return self.rms <= rms and self.peaks <= peaks


class RunStatistics(NamedTuple):
    """Statistics by which a run is compared with one of a finer step."""

    rms: np.ndarray  # (k,) of every sensor of the rig, and one of all links where they are recorded, m/s2
    peaks: np.ndarray  # (3,) sums of the largest forces of all pitches: left arcs, right arcs, ring; N
    shares: np.ndarray  # (3,) of ``peaks`` in forces that stand for one step

    @property
    def isolated(self) -> float:
        """Largest of the ``shares`` of sides that carry."""
        return float(self.shares[_carries(self.peaks)].max(initial=0.0))

    @property
    def doubtful_peaks(self) -> bool:
        """Whether peaks of a single step make up more than `ONE_STEP` of the mean peak of a side that carries."""
        return self.isolated > ONE_STEP

    def doubtful(self, side: str) -> bool:
        """Whether they do on one side."""
        return bool(self.shares[SIDES.index(side)] > ONE_STEP)

    def difference(self, finer: "RunStatistics") -> Difference:
        """Difference from a finer run.

        Peaks are compared by their sums over the same pitches: one that is only just touched moves the mean of those
        that touch, not what they carry.
        """
        carries, moves = _carries(finer.peaks), finer.rms > 0
        return Difference(
            float(np.abs(self.rms[moves] / finer.rms[moves] - 1).max(initial=0.0)),
            float(np.abs(self.peaks[carries] / finer.peaks[carries] - 1).max(initial=0.0)),
        )


def _carries(peaks):
    """Sides above a third of the largest."""
    return (peaks > 0) & (peaks > peaks.max() / 3)


class Alternation(NamedTuple):
    """Motion of all bodies that alternates from step to step."""

    share: float  # of its mean square in the mean square that the sensor reads; NaN if it was not measured
    looks: int  # samples in which it was measured
    pitches: float  # that came onto the sprocket meanwhile, at the speed that is asked for

    def enough(self, pitches: float) -> bool:
        """Whether there were samples enough for a verdict, and so many pitches came onto the sprocket."""
        return self.pitches >= pitches and self.looks >= LEAST_LOOKS


def doubt(alternating: Alternation, statistics: RunStatistics | None = None) -> str:
    """Why a record or a piece of it may be unresolved, or an empty string: nothing speaks against it so far."""
    if not alternating.enough(1.0):
        return ""
    if alternating.share > NOTICED:
        return f"contacts chatter: {alternating.share:.2g} of the sensor's mean square alternates from step to step"
    if statistics and statistics.doubtful_peaks:
        return f"{statistics.isolated:.0%} of the mean peak are forces that stand for one step"
    return ""


def largest_forces(ended, lasting, pitches: int, step: float, begin: float) -> tuple[np.ndarray, np.ndarray]:
    """Largest force of every pitch on each side (p, 3), N, and the ones among them that stand for one step (0 if not).

    Contacts that have ``ended`` and those still ``lasting`` (`CONTACT_INTERVAL`) were logged from ``begin`` (s) on. A
    peak whose neighbours are more than half of it lies between two steps. One in the first step of the log, of a
    contact that lasted then, or in the last step of one that lasts has a neighbour that was not logged.
    """
    largest, isolated = np.zeros((2, pitches, len(SIDES)))
    rows = np.concatenate([ended, lasting])[::-1]  # the last of equal forces below is then the first in time
    lasts, time = np.arange(len(rows)) < len(lasting), rows["peak_s"]
    cut = (time < begin + 1.5 * step) | (lasts & (time > rows["end_s"] - 1.5 * step))
    single = (abs(time / step - np.rint(time / step)) < 1e-5) & ~cut
    order = np.argsort(rows["peak_n"], kind="stable")
    entry = tuple(rows[name][order].astype(int) for name in ("pitch", "side"))
    # of the rows of an entry the last one stays, which is the largest
    largest[entry], isolated[entry] = rows["peak_n"][order], (rows["peak_n"] * single)[order]
    return largest, isolated


def mean_square(motion: np.ndarray, gravity: float) -> float:
    """Mean square of the y acceleration (m2/s4) that sensors report (Eq. 40), ``motion`` as in ``Recording.mean``."""
    return float((specific_force(motion[..., :2], motion[..., 2], gravity)[..., 1] ** 2).mean())


def run_statistics(record: Record, rows: slice, ended: list[np.ndarray], model: Model, begin: float) -> RunStatistics:
    """Statistics of samples, of contacts that ended in them and of open ones; ``begin`` of their log, s."""
    mean, own = record.samples.mean[rows], len(model.sensors.body)
    sensors = [mean[:, sensor] for sensor in (*range(own), slice(own, None))]
    lasting = record.contact_log.open[record.contact_log.open["end_s"] > 0]
    largest, isolated = largest_forces(np.concatenate(ended), lasting, len(model.shoes.link_body), model.step, begin)
    peaks = largest.sum(axis=0)
    return RunStatistics(
        np.sqrt([mean_square(motion, model.chain.gravity) for motion in sensors if motion.size]),
        peaks,
        isolated.sum(axis=0) / np.maximum(peaks, 1e-300),
    )


FINER = 4  # times smaller step of a piece that is doubtful
# Times smaller step of a record that is doubtful for its length alone: half a step shows half of an error of order 1,
# so that differences are doubled.
HALF = 2
LEAD = 5.0  # s before a record that are at most run again with it
PIECE, BETWEEN = 2.0, 20.0  # s that are run again, and from the beginning of one piece to that of the next
BRIEF = "the run is shorter than a turn of the loop"
# Damping in proportion to the step hides what `doubt` looks for.
DAMPED = "the method damps contacts in proportion to its step"


def again(scene) -> str:
    """Why `PIECE` of a scene is run again with a smaller step whatever its contacts show, or an empty string.

    A linearly implicit method (`DAMPED`), of which nothing else tells how wrong it is; or a record in which the link of
    its sensor comes onto each wheel at most once (`BRIEF`): an impact has an error of the order of the step, so that
    its RMS may be off. Not asked of `Loop.record`, where every part of a longer run would be run again.
    """
    pitches, method = scene.duration / scene.periods.passage, METHODS[scene.integrator]  # not a number at rest
    if not pitches >= 1.0:
        return ""
    # rounded: a record of one turn ends at a sample
    brief = method.staggered and round(pitches) < scene.rig.chain.pitches
    return DAMPED if method.linearly_implicit else BRIEF if brief else ""


def explicit(scene) -> dict[str, Any]:
    """Fields of the explicit run by which a linearly implicit one is judged; its step (s) is at most as large."""
    other = scene.with_(integrator="semi_implicit", step=None)
    return {"integrator": other.integrator, "step": min(scene.time_step, other.time_step)}


Rerun = Callable[[int], RunStatistics]


class StepCheck:
    """Check of the step (s) of a record: of its first two seconds, and of two in every twenty from there on.

    ``reason`` says what speaks against the record so far, ``difference`` is the largest one of the pieces that were run
    again.
    """

    def __init__(self, scene, step: float):
        self.scene, self.step, self.reason, self.difference = scene, step, "", Difference(nan, nan)
        self._damped = METHODS[scene.integrator].linearly_implicit

    def judge(
        self, seconds: float, alternating: Alternation, coarse: RunStatistics, rerun: Rerun, first: bool = False
    ) -> None:
        """Judge a piece of so many seconds, which may be the ``first`` of a run.

        ``rerun`` returns the statistics of the piece with a step so many times smaller: `FINER` from where the run
        began, if that is near, `HALF` from its own beginning, 1 from there with the step of `explicit`, for two
        linearly implicit steps may agree and be wrong alike. It raises `InputError` where no such run is possible.

        Raises `DivergenceError`: the piece is doubtful, and with a finer step RMS differs by more than `RMS`, or peaks
        by more than `PEAKS` where contacts flip.
        """
        reason = doubt(alternating, coarse)
        self.reason = self.reason or reason  # also where no finer step can be tried
        times = 1 if self._damped else FINER if reason else HALF
        # only the length of the record speaks against it: its own impacts alone are in doubt
        if not (reason := reason or (again(self.scene) if first else "")):
            return
        try:
            differences = coarse.difference(rerun(times))
        except InputError:
            return
        doubled = 2.0 if times == HALF else 1.0
        difference = Difference(*(doubled * value for value in differences))
        self.reason = self.reason or reason
        self.difference = Difference(*map(float, np.fmax(self.difference, difference)))
        # An implicit step is coarse on purpose, and single impacts need steps that nothing else needs: what is missed
        # is said, and refused only where contacts flip.
        missed = difference.rms > RMS and not self._damped
        if missed or (not difference.within() and alternating.share > 1.0):
            finer = f"a step {times} times smaller" if times > 1 else "an explicit step"
            raise DivergenceError(
                f"contacts are not resolved: {reason}, and with {finer} RMS over "
                f"{seconds:.3g} s differs by {differences.rms:.2g} and the mean peak by {differences.peaks:.2g} of it, "
                f"more than {RMS / doubled:g} and {PEAKS / doubled:g}; use a step smaller than {self.step:g} s "
                "(`check` finds one)"
            )

    def resolution(self, alternating: Alternation) -> Resolution:
        """State of the resolution of the record so far."""
        reason, share = self.reason or doubt(alternating), None if isnan(alternating.share) else alternating.share
        if not alternating.looks:
            return Resolution(OPEN, share, "steps of this integrator are not watched")
        if not reason and self._damped:
            return Resolution(OPEN, share, f"{DAMPED}, and no piece of the run was tried with another one")
        if reason and not (self.difference.within(RMS / 2, PEAKS / 2) and alternating.share <= FLIPS):
            if not isnan(self.difference.rms):
                rms, peaks = self.difference
                reason += f", and by a finer step RMS is {rms:.2g} and the mean peak {peaks:.2g} of it off"
            advice = f"compare with a step smaller than {self.step:g} s"
            return Resolution(NO, share, f"contacts are hardly resolved: {reason}; {advice}")
        if not reason and not alternating.enough(LEAST_PITCHES):
            return Resolution(
                OPEN, share,
                f"{alternating.pitches:.2g} pitches came onto the sprocket, too few to tell whether contacts are "
                f"resolved; {LEAST_PITCHES:g} are needed",
            )  # fmt: skip
        return Resolution(YES, share)
