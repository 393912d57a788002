"""Step check: chatter and isolated peaks make a record doubtful, a repeated piece with a finer step decides.

If a contact is too stiff for the step, its force alternates from one step to the next; the motion of all bodies
reveals it (`integrate.run`), long before the sensor's link has made a turn of the loop. A peak force of a single step
is not resolved, either (`integrate.contact_log`), and a record shorter than a turn of the loop is doubtful for its
length. The error is measured by a run with a finer step (`StepCheck`); all comparisons of two steps use these bounds.
"""

from collections.abc import Callable
from math import isnan, nan
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import SIDES, Record
from trackdyn.model.constants import Model
from trackdyn.simulation.signals import mean_square

# Largest relative difference of RMS and mean peak from a run with a finer step; half of it counts as resolved.
RMS, PEAKS = 0.02, 0.05
# The same of a step that is recommended for all runs of a rig (`rig_check`): half of ``RMS``, since its trial is a
# second at one speed.
RECOMMENDED = 0.01
# Alternating share that makes a record doubtful. Set in a pilot study (docs/speed-and-accuracy.md), in which no run
# below it had an error of 2 % in RMS.
DOUBTFUL_SHARE = 0.01
LARGEST_SHARE = 2 * RMS  # alternating, of the mean square of single steps (``Recording.raw``): an error of ``RMS``
# Largest share of the mean peak in peaks of a single step, with a neighbour below half: the true peak may be twice as
# large, so that an error of half of a tenth of the mean peak is possible, which is ``PEAKS``.
ONE_STEP = 0.1
LEAST_SAMPLES = 10  # of a verdict
# Pitches that must have come onto the sprocket before a record can be resolved; one pitch suffices to show that it is
# not, for it is no longer the first impact.
LEAST_PITCHES = 3.0
YES, NO, OPEN = "yes", "no", "not judged"


class Resolution(NamedTuple):
    """Resolution of a record by its step, with a reason."""

    # ``yes``; ``no``: doubtful, and differs by more than half of ``RMS`` or ``PEAKS`` from a run with a finer step, or
    # alternates by more than ``LARGEST_SHARE``; ``not judged``
    state: str = OPEN
    share: float | None = None  # `Alternation.share`
    reason: str = ""  # a sentence; empty for ``yes``


class Difference(NamedTuple):
    """Largest relative differences from a run with a finer step; NaN without such a run."""

    rms: float  # relative difference of RMS
    peaks: float  # relative difference of mean peaks on loaded sides

    def within(self, rms: float = RMS, peaks: float = PEAKS) -> bool:
        """Return whether both are within bounds."""
        return self.rms <= rms and self.peaks <= peaks


class RunStatistics(NamedTuple):
    """Statistics that are compared between a run and one with a finer step."""

    rms: np.ndarray  # (k,) of every sensor of the rig, and of all links if they are recorded, m/s2
    peaks: np.ndarray  # (3,) sums of the largest forces of all pitches: left arcs, right arcs, ring; N
    shares: np.ndarray  # (3,) of peaks of a single step in ``peaks``

    def doubtful(self, side: str) -> bool:
        """Return whether peaks of a single step exceed `ONE_STEP` of the mean peak of a side."""
        return bool(self.shares[SIDES.index(side)] > ONE_STEP)

    def difference(self, finer: "RunStatistics") -> Difference:
        """Return the difference from a run with a finer step."""
        # sums of peaks over the same pitches: a grazing contact changes the mean over the contacts, hardly the sum
        loaded, moving = _loaded(finer.peaks), finer.rms > 0
        pairs = (self.rms[moving], finer.rms[moving]), (self.peaks[loaded], finer.peaks[loaded])
        return Difference(*(float(np.abs(coarse / fine - 1).max(initial=0.0)) for coarse, fine in pairs))


def _loaded(peaks):
    """Return the mask of the sides whose peak exceeds a third of the largest."""
    return (peaks > 0) & (peaks > peaks.max() / 3)


class Alternation(NamedTuple):
    """Chatter: motion of all bodies that alternates from step to step."""

    share: float  # of its mean square in the mean square of the sensor's signal; NaN if it was not measured
    samples: int  # in which it was measured
    pitches: float  # that came onto the sprocket meanwhile, at nominal speed

    def enough(self, pitches: float) -> bool:
        """Return whether `LEAST_SAMPLES` were measured and ``pitches`` came onto the sprocket."""
        return self.pitches >= pitches and self.samples >= LEAST_SAMPLES


def doubt(alternating: Alternation, statistics: RunStatistics | None = None) -> str:
    """Return the reason why a record or a piece of it may be unresolved, an empty string if there is none."""
    if not alternating.enough(1.0):
        return ""
    if alternating.share > DOUBTFUL_SHARE:
        return f"contacts chatter: {alternating.share:.2g} of the sensor's mean square alternates from step to step"
    isolated = statistics.shares[_loaded(statistics.peaks)].max(initial=0.0) if statistics else 0.0
    return f"{isolated:.0%} of the mean peak are forces of a single step" if isolated > ONE_STEP else ""


def largest_forces(ended, lasting, pitches: int, step: float, begin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest force of every pitch on each side (p, 3), N, and those of a single step (0 for the others).

    Contacts that have ``ended`` and those still ``lasting`` (`CONTACT_INTERVAL`) were logged from ``begin`` (s) on. A
    peak whose neighbours exceed half of it lies between two steps and is logged so. A peak in the first step of the
    log, or in the last step of a lasting contact, has a neighbour that was not logged and does not count as isolated.
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


def run_statistics(record: Record, rows: slice, ended: list[np.ndarray], model: Model, begin: float) -> RunStatistics:
    """Return the statistics of samples, and of contacts that ended in them or are open; ``begin`` of their log, s."""
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


DOUBTFUL_STEP_DIVISOR = 4  # of the step of a doubtful piece
# Of the step of a record that is doubtful only for its length: with half the step an error of order 1 is half as large,
# so that differences are doubled.
SHORT_STEP_DIVISOR = 2
LONGEST_LEAD = 5.0  # s before a record that are repeated with it, too
PIECE, PIECE_PERIOD = 2.0, 20.0  # s of a piece, and from the beginning of one piece to that of the next
SHORT_RUN_REASON = "the run is shorter than a turn of the loop"
# Damping in proportion to the step suppresses the signs that `doubt` detects.
DAMPED_REASON = "the method damps contacts in proportion to its step"


def mandatory_rerun(scene) -> str:
    """Return the reason to check the step of a scene whatever its contacts show, an empty string if there is none.

    The error of a linearly implicit method has no other sign (`DAMPED_REASON`); an impact has an error of the order of
    the step, and in a short record the link of its sensor comes onto each wheel at most once (`SHORT_RUN_REASON`). It
    does not apply to `Loop.record`, which would repeat every part of a longer run.
    """
    pitches, method = scene.duration / scene.periods.passage, METHODS[scene.integrator]  # not a number at rest
    if not pitches >= 1.0:
        return ""
    # rounded: a record of one turn ends at a sample
    short = method.staggered and round(pitches) < scene.rig.chain.pitches
    return DAMPED_REASON if method.linearly_implicit else SHORT_RUN_REASON if short else ""


def explicit_fields(scene) -> dict[str, Any]:
    """Return the fields of the explicit run that checks a linearly implicit one; its step (s) is at most as large."""
    other = scene.with_(integrator="semi_implicit", step=None)
    return {"integrator": other.integrator, "step": min(scene.time_step, other.time_step)}


class StepCheck:
    """Check of the step (s) of a record in its first `PIECE`, and in one `PIECE` of every `PIECE_PERIOD`.

    ``reason`` is the reason to doubt the record so far, ``difference`` the largest of the repeated pieces.
    """

    def __init__(self, scene, step: float):
        self.scene, self.step, self.reason, self.difference = scene, step, "", Difference(nan, nan)
        self._damped = METHODS[scene.integrator].linearly_implicit

    def judge(
        self, seconds: float, alternating: Alternation, coarse: RunStatistics, rerun: Callable[[int], RunStatistics],
        first: bool = False,
    ) -> None:  # fmt: skip
        """Check a piece of ``seconds``, which may be the ``first`` of a run.

        ``rerun`` returns the statistics of the piece with the step divided by its argument (else `InputError`):
        `DOUBTFUL_STEP_DIVISOR` from the beginning of the run, if that is near, `SHORT_STEP_DIVISOR` from that of the
        piece, and 1 with `explicit_fields`, for two linearly implicit steps may agree and have the same error.

        Raises `DivergenceError`: the piece is doubtful, and with a finer step RMS differs by more than `RMS`, or peaks
        by more than `PEAKS` while contacts chatter.
        """
        reason = doubt(alternating, coarse)
        self.reason = self.reason or reason  # also without a finer run
        divisor = 1 if self._damped else DOUBTFUL_STEP_DIVISOR if reason else SHORT_STEP_DIVISOR
        # a record that is doubtful only for its length is repeated without its lead-in
        if not (reason := reason or (mandatory_rerun(self.scene) if first else "")):
            return
        try:
            differences = coarse.difference(rerun(divisor))
        except InputError:
            return
        doubled = 2.0 if divisor == SHORT_STEP_DIVISOR else 1.0
        difference = Difference(*(doubled * value for value in differences))
        self.reason = self.reason or reason
        self.difference = Difference(*map(float, np.fmax(self.difference, difference)))
        # An implicit step is coarse on purpose, and single impacts need steps that other motion does not need: their
        # differences are reported, and refused only if contacts chatter.
        missed = difference.rms > RMS and not self._damped
        if missed or (not difference.within() and alternating.share > 1.0):
            finer = f"a step {divisor} times smaller" if divisor > 1 else "an explicit step"
            raise DivergenceError(
                f"contacts are not resolved: {reason}, and with {finer} RMS over "
                f"{seconds:.3g} s differs by {differences.rms:.2g} and the mean peak by {differences.peaks:.2g} of it, "
                f"more than {RMS / doubled:g} and {PEAKS / doubled:g}; use a step smaller than {self.step:g} s "
                "(`check` finds one)"
            )

    def resolution(self, alternating: Alternation) -> Resolution:
        """Return the resolution of the record so far."""
        reason, share = self.reason or doubt(alternating), None if isnan(alternating.share) else alternating.share
        if not alternating.samples:
            return Resolution(OPEN, share, "steps of this integrator are not watched")
        if not reason and self._damped:
            return Resolution(OPEN, share, f"{DAMPED_REASON}, and no piece of the run was repeated with another one")
        if reason and not (self.difference.within(RMS / 2, PEAKS / 2) and alternating.share <= LARGEST_SHARE):
            if not isnan(self.difference.rms):
                rms, peaks = self.difference
                reason += f", and with a finer step RMS differs by {rms:.2g} and the mean peak by {peaks:.2g} of it"
            advice = f"compare with a step smaller than {self.step:g} s"
            return Resolution(NO, share, f"contacts are hardly resolved: {reason}; {advice}")
        if not reason and not alternating.enough(LEAST_PITCHES):
            few = f"{alternating.pitches:.2g} pitches came onto the sprocket, too few to tell whether contacts"
            return Resolution(OPEN, share, f"{few} are resolved; {LEAST_PITCHES:g} are needed")
        return Resolution(YES, share)
