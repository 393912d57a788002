"""A row: every scene of a rig that sentences of the paper are judged by."""

import numpy as np

from laboratory.plausible.revolution import summary
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.spectra import high_frequency_rms
from trackdyn.measure.whole_loop import stitch
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Periods, Scene
from trackdyn.scene.step import first_that_runs
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash

SOURCES = module_hash(__name__)


def run_rig(rig: dict, scenes: list[list], fields: dict, row: dict) -> dict:
    """Run all scenes of a rig: the values of a row of the sweep engine."""
    loaded = Rig.model_validate(rig)
    return first_that_runs(row["steps_s"], lambda step: _scenes(loaded, scenes, fields | {"step": step}, row))


def _scenes(rig: Rig, scenes: list[list], fields: dict, row: dict) -> dict:
    starts = SettledLoops(capacity=len(scenes))
    least = Scene.ring_range(rig)[0]
    settings: dict = {}
    for rpm, ring, sensed in scenes:
        without = scene_name(rpm, None)
        if ring is not None and ring < least and without in settings:  # the ring touches nothing
            settings[scene_name(rpm, ring)] = settings[without]
            continue
        span = row["passages"] * Periods.at(rig, rpm).passage
        scene = Scene(
            rig, motor_rpm=rpm, ring_radius=ring, ramp=row["ramp_s"], lead_in=row["lead_in_s"], contact_log=False,
            duration=whole_samples(rig.rate, span) + 2 / rig.rate, integrator="linearly_implicit",
            pitches=list(range(1, rig.chain.pitches + 1)), every_link=sensed, **fields,
        )  # fmt: skip
        recording = simulate(scene, starts=starts)
        values, times = summary(recording)
        values |= {f"event {name}": seconds for name, seconds in times.items()}
        settings[scene_name(rpm, ring)] = values | (_sensed(recording) if sensed else {})
    return settings


def scene_name(rpm: float, ring: float | None) -> str:
    """Name of a scene in a row: ``115 none``, ``115 0.308``."""
    return f"{rpm:g} {'none' if ring is None else format(ring, 'g')}"


def _sensed(recording: Recording) -> dict[str, float]:
    """RMS, SD and content from 20 Hz on (g) of a revolution of one link."""
    ay = stitch(recording)
    measures = {"rms_g": np.sqrt(np.mean(ay**2)), "sd_g": ay.std()}
    measures["high_frequency_g"] = high_frequency_rms(ay, recording.rate)
    return {name: float(value) for name, value in measures.items()}
