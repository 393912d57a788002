"""The one door: a scene in, a recording out."""

import time
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import check_writable
from trackdyn.inputs.validation import typed
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.loop_arrays import read_checkpoint, write_checkpoint
from trackdyn.simulation.recorder import Recorder, check_memory
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops

# Time between two checkpoints, s of computing; writing one takes little of it.
BETWEEN_CHECKPOINTS = 30.0


@typed
def simulate(
    scene: Scene, progress: bool = False, checkpoint: Path | str | None = None, starts: SettledLoops | None = None
) -> Recording:
    """Settle the loop, start the sprocket, wait for steady running and record.

    Parameters
    ----------
    scene : Scene
        What to run.
    progress : bool
        Show a progress bar with simulated time, speed and remaining time.
    checkpoint : path or None
        File that is written from time to time while the run is recorded. If it is there, the run goes on from it
        and gives the bytes that it would have given; `Recording.save` removes it.
    starts : SettledLoops or None
        Loops that were settled before, for a series of scenes: the same bytes, sooner.

    Returns
    -------
    Recording

    Raises
    ------
    DivergenceError
        If a body leaves the physical range; nothing is returned or written then.
    InputError
        The checkpoint belongs to another scene or other sources; the recording does not fit into the memory.
    """
    check_memory(scene)
    if checkpoint is not None:
        check_writable(checkpoint)
    if scene.chain == "belt":
        return belt_recording(scene)
    lead = scene.ramp + scene.lead_in
    bar = tqdm(
        total=lead + scene.duration + 1e-6,  # sums of parts may round beyond it
        disable=not progress,
        unit="s",
        desc=f"{scene.motor_rpm:g} rpm",
        bar_format="{desc} |{bar}| {n:.1f} of {total:.1f} s simulated, {rate_noinv_fmt}, {remaining} left",
    )
    with bar:
        if checkpoint is not None and Path(checkpoint).exists():
            data = read_checkpoint(checkpoint)
            loop = Loop.restored(data)
            if loop.scene != scene:
                raise InputError(f"{checkpoint}: is the checkpoint of another scene; name another file to start again")
            writer = Recorder(loop)
            writer.restore(data)
            bar.update(lead + writer.done / scene.rig.rate)
        else:
            loop = Loop(scene, starts)
            origin = loop.copy()
            loop.copy().advance(1.0 / scene.rig.rate)  # settling and compilation are over
            bar.unpause()
            loop.advance(lead, bar.update)
            writer = Recorder(loop, origin=origin)
        saved = time.monotonic()
        while not writer.finished:
            bar.update(writer.chunk())
            if checkpoint is not None and time.monotonic() - saved > BETWEEN_CHECKPOINTS:
                write_checkpoint(checkpoint, writer.describe())
                saved = time.monotonic()
    recording = writer.recording()
    return recording if checkpoint is None else replace(recording, checkpoint=Path(checkpoint).resolve())
