"""Run a scene: settle, start up, record."""

from trackdyn.inputs.validation import typed
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder, check_memory
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops


@typed
def simulate(scene: Scene, progress: bool = False, starts: SettledLoops | None = None) -> Recording:
    """Settle the loop, start the sprocket, wait for steady running and record.

    Parameters
    ----------
    scene : Scene
    progress : bool
        Show a progress bar with simulated time, speed and remaining time.
    starts : SettledLoops or None
        Loops that were settled before, for a series of scenes: faster, with the same bytes.

    Returns
    -------
    Recording

    Raises
    ------
    DivergenceError
        A body leaves the physical range, or contacts are not resolved by the step.
    InputError
        The loop does not settle, or the recording does not fit into the memory.
    """
    check_memory(scene)
    if scene.chain == "belt":
        return belt_recording(scene)
    from tqdm import tqdm

    total = scene.ramp + scene.lead_in + scene.duration + 1e-6  # sums of parts may round beyond it
    show = "{desc} |{bar}| {n:.1f} of {total:.1f} s simulated, {rate_noinv_fmt}, {remaining} left"
    with tqdm(total=total, disable=not progress, unit="s", desc=f"{scene.motor_rpm:g} rpm", bar_format=show) as bar:
        loop = Loop(scene, starts)
        origin = loop.copy()
        loop.copy().advance(1.0 / scene.rig.rate)  # settling and compilation are over
        bar.unpause()
        loop.lead_in(bar.update)
        recorder = Recorder(loop, origin=origin)
        while not recorder.finished:
            bar.update(recorder.chunk())
    return recorder.recording()
