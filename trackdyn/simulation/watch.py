"""Pieces of a record that are doubtful are run again with a finer step, and what differs decides."""

from math import nan
from weakref import proxy

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.simulation.resolution import (
    PEAKS,
    RMS,
    Answer,
    Resolution,
    alternating_share,
    doubt,
    passed_pitches,
    resolution,
)

FINER = 4  # times
LEAD = 5.0  # s before a record that are at most run again with it
PIECE, BETWEEN = 2.0, 20.0  # s that are run again, and from the beginning of one piece to that of the next


class Watch:
    """Watches a recorder (`Recorder`): the first two seconds of a record, and two in every twenty from there on.

    ``origin`` is the loop before it came to where the record begins, so that the way there is run again, too: what a
    step that is too large has done until then is part of its record. ``found`` holds the doubts about the record so
    far, ``off`` the largest differences of RMS and mean peak in the pieces that were run again; NaN if none was.
    """

    def __init__(self, recorder, origin=None):
        # weak: in a cycle, records wait for the garbage collector, which comes by objects and not by bytes
        self.recorder, self.found, self.off = proxy(recorder), "", (nan, nan)
        self.begin()
        self.first_of_run = origin is not None
        if origin is not None and recorder.begin - origin.time <= LEAD:
            self.origin = origin

    def begin(self) -> None:
        """Begin a piece."""
        recorder = self.recorder
        self.origin, self.first_of_run = recorder.loop.copy(), False
        self.first, self.ended, self.alternating = recorder.done, len(recorder.ended), recorder.alternating.copy()
        spells, self.time = recorder.record.spells, recorder.loop.time
        self.open = spells.open.copy(), spells.last.copy()

    def look(self) -> None:
        """Judge a piece when it is over.

        Raises `DivergenceError`: it is doubtful, and with a finer step RMS differs by more than `resolution.RMS`, or
        peaks by more than `resolution.PEAKS` where contacts flip.
        """
        recorder, rate = self.recorder, self.recorder.loop.scene.rig.sensor.rate
        seconds = (recorder.done - self.first) / rate
        if self.origin is not None and (seconds >= PIECE or recorder.finished):
            self._judge(seconds)
            self.origin = None
        if seconds >= BETWEEN and not recorder.finished:
            self.begin()

    def _judge(self, seconds: float) -> None:
        recorder = self.recorder
        model, rows = recorder.loop.model, recorder.record.mean[self.first : recorder.done]
        coarse = recorder.answer(self.first, self.ended)
        found = doubt(recorder.alternating - self.alternating, model, rows, recorder.driven(self.first), coarse.alone)
        self.found = self.found or found  # also where no finer step can be tried
        found = found or self._brief()
        # where somebody steered in between, another run would be another motion
        if not found or model.drive != self.origin.model.drive:
            return
        try:
            off = coarse.differs(self._finer(seconds))
        except InputError:  # no finer step is allowed
            return
        self.found = self.found or found
        self.off = tuple(float(np.fmax(*pair)) for pair in zip(self.off, off, strict=True))
        # An implicit step is coarse on purpose, and single impacts need steps that nothing else needs: what is missed
        # is said, and refused only where contacts flip.
        missed = off[0] > RMS and recorder.loop.work.implicit is None
        if missed or ((off[0] > RMS or off[1] > PEAKS) and self._share(rows) > 1.0):
            raise DivergenceError(
                f"contacts are not resolved: {found}, and with a step {FINER} times smaller RMS over {seconds:.3g} s "
                f"differs by {off[0]:.2g} and the mean peak by {off[1]:.2g} of it, more than {RMS:g} and {PEAKS:g}; "
                f"use a step smaller than {model.step:g} s (trackdyn check finds one)"
            )

    def _brief(self) -> str:
        """Say that a run is shorter than a turn of the loop, in its first piece; an empty string if it is not.

        Its sensor's link comes onto each wheel at most once, and an impact has an error of the order of the step, so
        that its RMS may be off. Not said of `Loop.record`, where every part of a longer run would be run again.
        """
        recorder, scene = self.recorder, self.recorder.loop.scene
        if not self.first_of_run or scene.loop != "on_wheels" or not METHODS[scene.integrator].staggered:
            return ""
        pitches = passed_pitches(recorder.loop.model, recorder.samples / scene.rig.sensor.rate)
        # rounded: a record of one turn ends at a sample
        if pitches < 1.0 or round(pitches) >= scene.rig.chain.pitches:
            return ""
        return "the run is shorter than a turn of the loop"

    def _share(self, rows) -> float:
        """What alternates in the piece."""
        return alternating_share(self.recorder.alternating - self.alternating, self.recorder.loop.model, rows)

    def _finer(self, seconds: float) -> Answer:
        """The piece with a finer step; the loop from which a run begins is settled with it, too."""
        loop, requested = self.origin, self.recorder.requested
        step = loop.model.step / FINER
        settled = self.first_of_run and loop.time == 0.0
        finer = loop.__class__(loop.scene.with_(step=step)) if settled else loop.changed(step=step)
        finer.advance(self.time - loop.time)
        again = self.recorder.__class__(finer, seconds, (), 0.0, requested["spells"], requested["every_link"], False)
        again.record.spells.open[:], again.record.spells.last[:] = self.open
        return again.finish().answer()

    def resolution(self) -> Resolution:
        """State of the resolution of the record so far."""
        recorder = self.recorder
        mean, model, driven = recorder.record.mean[: recorder.done], recorder.loop.model, recorder.driven()
        found = self.found or doubt(recorder.alternating, model, mean, driven, 0.0)
        return resolution(recorder.alternating, model, mean, driven, found, self.off)
