"""A row: every scene of a rig by which sentences of the paper are judged, from one start or several."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from laboratory.plausible.revolution import summary
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.spectra import high_frequency_rms
from trackdyn.measure.whole_loop import mobilised_friction, stitch
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Periods, Scene
from trackdyn.scene.step import first_that_runs
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops
from trackdyn.sources import module_hash

SOURCES = module_hash(__name__)
Values = Mapping[str, Mapping[str, Any]]  # of a start, by the name of the scene (`scene_name`)


def run_rig(rig: dict, scenes: list[list], fields: dict, row: dict) -> dict[str, list]:
    """Run all scenes of a rig: ``starts``, the `Values` of each start, are the values of a row of the sweep engine."""
    loaded = Rig.model_validate(rig)
    settled = SettledLoops(capacity=len(scenes))

    def run(step: float) -> list[dict]:
        return [_start(loaded, scenes, fields, row | start | {"step_s": step}, settled) for start in row["starts"]]

    return {"starts": first_that_runs(row["steps_s"], run)}


def _start(rig: Rig, scenes: list[list], fields: dict, row: Mapping, settled: SettledLoops) -> dict[str, dict]:
    least, values = Scene.ring_range(rig)[0], {}
    for rpm, ring, detailed in scenes:
        without = scene_name(rpm, None)
        touching = None if ring is None or ring < least else ring  # a smaller ring touches nothing
        if touching != ring and without in values:
            values[scene_name(rpm, ring)] = values[without]
            continue
        recording = _recorded(rig, rpm, touching, detailed, fields, row, settled)
        measured, friction = summary(recording, detailed), mobilised_friction(recording).value
        if detailed:
            ay = stitch(recording)  # of a revolution of one link
            measured |= {"rms_g": float(np.sqrt(np.mean(ay**2))), "sd_g": float(ay.std())}
            measured["high_frequency_g"] = float(high_frequency_rms(ay, recording.rate))
        measured["mobilised_friction"] = None if friction != friction else friction
        measured["settled_tension_n"] = recording.layout.settled_tension_n
        values[scene_name(rpm, ring)] = measured
    return values


def _recorded(
    rig: Rig, rpm: float, ring: float | None, detailed: bool, fields: dict, row: Mapping, settled: SettledLoops
) -> Recording:
    """Record some passages after a wait in coarse steps, which the linearly implicit method allows."""
    span = row["passages"] * Periods.at(rig, rpm).passage
    scene = Scene(
        rig, motor_rpm=rpm, ring_radius=ring, ramp=row["ramp_s"], lead_in=0.0, contact_log=False,
        duration=whole_samples(rig.rate, span) + 2 / rig.rate, pitches=list(range(1, rig.chain.pitches + 1)),
        every_link=detailed, integrator="linearly_implicit", **fields,
    )  # fmt: skip
    loop = Loop(scene.with_(step=row["coarser"] * row["step_s"]), settled)
    loop.advance(row["wait_s"])
    method = {"integrator": row["integrator"], "step": row["step_s"]}
    loop = loop.changed(**method)
    loop.advance(row["last_s"])
    # not checked by a second run, which costs as much again: a row counts as not decided where two starts differ
    return Recorder(loop, scene.with_(**method), checked=False).finish().recording()


def scene_name(rpm: float, ring: float | None) -> str:
    """Return the name of a scene in a row: ``115 none``, ``115 0.308``."""
    return f"{rpm:g} {'none' if ring is None else format(ring, 'g')}"
