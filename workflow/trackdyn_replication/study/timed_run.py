"""Cost of a run: wall and CPU seconds per simulated second, without settling; apart, since a peer needs no measures."""

from time import perf_counter, process_time
from typing import NamedTuple

from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording


class TimedRun(NamedTuple):
    """Recording, CPU seconds to settle its loop, and wall and CPU seconds per simulated second."""

    recording: Recording
    start_cpu_s: float
    wall_s_per_s: float
    cpu_s_per_s: float


def timed_run(scene: Scene) -> TimedRun:
    """Settle, start and record a scene; compile kernels beforehand, or their compilation counts."""
    begin = process_time()
    loop = Loop(scene)
    wall, cpu = perf_counter(), process_time()
    loop.lead_in()
    options = {name: getattr(scene, name) for name in ("frame_interval", "contact_log", "every_link")}
    recording = loop.record(scene.duration, **options)
    seconds = scene.ramp + scene.lead_in + scene.duration
    return TimedRun(recording, cpu - begin, (perf_counter() - wall) / seconds, (process_time() - cpu) / seconds)
