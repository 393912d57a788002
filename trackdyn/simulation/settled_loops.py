"""Settled loops that are kept: scenes that differ in what settling does not see need not settle again.

Settling takes most of the time of a short scene. Of what a scene asks for, the speed and all that concerns the record
matter only afterwards, and the ring only in the last quarter of it.
"""

import copy
import json
from collections.abc import Callable
from typing import TypeVar

from trackdyn.model.constants import Model
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.scene.build import build_drive
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settling import Settling, settle, settling_step, tensioned
from trackdyn.simulation.start_checks import refuse_step

# What a scene asks for that a loop at rest does not know yet.
LATER = ("motor_rpm", "duration", "lead_in", "ramp", "pitches", "frame_interval", "spells", "every_link", "sliding")
KeptLoop = TypeVar("KeptLoop")


class SettledLoops:
    """The last ``kept`` settled loops, for a series of scenes; every scene gets the bytes that it would get alone."""

    def __init__(self, kept: int = 8):
        self.kept = kept
        self._tensioned: dict[str, Settling] = {}
        self._settled: dict[str, tuple[Model, State, Work, dict]] = {}

    def settle(self, scene: Scene) -> tuple[Model, State, Work, dict]:
        """As `settling.settle`."""
        if scene.loop == "free":
            return settle(scene)
        # the step of the settling heeds the step limits, and they the speed and the ring
        known = {name: value for name, value in scene.describe().items() if name not in LATER}
        known["settling_step"] = settling_step(scene)
        ring = known.pop("ring_radius")
        common = json.dumps(known, sort_keys=True)
        model, state, work, layout = self._copy(
            self._settled,
            f"{ring!r} {common}",
            lambda: settle(scene, self._copy(self._tensioned, common, lambda: tensioned(scene))),
        )
        refuse_step(scene, model, layout["settled_tension_n"])
        return model._replace(drive=build_drive(scene)), state, work, layout

    def _copy(self, kept: dict[str, KeptLoop], key: str, make: Callable[[], KeptLoop]) -> KeptLoop:
        found = kept.pop(key) if key in kept else make()
        kept[key] = found  # the last one used is the last to go
        if len(kept) > self.kept:
            del kept[next(iter(kept))]
        return copy.deepcopy(found)
