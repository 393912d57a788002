"""Command that runs a scene: ``trackdyn simulate``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import console, options
from trackdyn.inputs.errors import InputError


def simulate(
    out: Annotated[Path, options.file_argument("Recording to write", ".npz")],
    rig: options.RigName = options.DEFAULT_RIG,
    rpm: options.SpeedOption = 115.0,
    ring_radius: options.RingRadius = None,
    load: options.Load = None,
    duration: Annotated[float, options.number("--duration", "Recorded time, s.")] = 20.0,
    lead_in: Annotated[
        float, options.number("--lead-in", "Time at constant speed before the record, s; after 1 s of start-up.")
    ] = 5.0,
    preset: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            autocompletion=lambda: ["fast", "standard", "paper", "reference"],
            help="Bundle of choices: fast, standard, paper or reference; by default standard, or that of --tolerance.",
        ),
    ] = None,
    step: options.StepOption = None,
    choose: options.Choose = None,
    tolerance: options.Tolerance = None,
    measure: options.Measures = None,
    longest: options.LongestRun = 60.0,
    rate: Annotated[
        float | None,
        options.number(
            "--rate", "Samples per second, Hz, such as your sensor's; the rig's by default. The step follows."
        ),
    ] = None,
    pitch: options.Pitches = None,
    quiet: options.Quiet = False,
) -> None:
    """Run one scene and write its recording.

    A file of that name is replaced when the run is done. With --tolerance, trial runs find the cheapest method and step
    that keep it, unless these are options, and the plan is printed. The run then ends when the error of every --measure
    is at most that share of its value, or of a sprocket turn for contact durations, regardless of --duration.

    Example: `trackdyn simulate run.npz --rpm 150 --duration 12` records 12 s of the default rig at 150 rev/min.
    """
    from tqdm import tqdm

    from trackdyn.jit import announce
    from trackdyn.rig.rig import foreign_groove, load_rig
    from trackdyn.scene.scene import Scene

    if measure and tolerance is None:
        raise InputError("--measure needs --tolerance, such as --tolerance 1%")
    loaded, fields = load_rig(rig), options.scene_fields(ring_radius, step, choose)
    fields |= {"pitches": pitch} if pitch else {}
    fields |= {} if load is None else {"load": load}
    if rate is not None:
        loaded = loaded.sampled(rate)
    scene = Scene(loaded, rpm, duration=duration, lead_in=lead_in, preset=preset, **fields)
    if foreign := foreign_groove(loaded, rig):
        console.warn(foreign)
    if not quiet:
        announce(lambda text: tqdm.write(f"trackdyn: {text}", file=sys.stderr))  # above a bar
    from trackdyn.simulation.recorder import file_bytes

    options.check_output(out, True, rig, size=file_bytes(scene))
    if out.exists():
        console.warn(f"{out} exists and is replaced when the run is done; until then Ctrl-C keeps it")
    if tolerance is None:
        _for_its_duration(scene, out, quiet)
        return
    free = preset is None and not {"step", "integrator"} & fields.keys()
    if not _until_converged(scene, dict.fromkeys(measure or ["rms"], tolerance), longest, free, out, quiet):
        raise InputError(
            f"--longest = {longest:g} s is too short for --tolerance {tolerance:g}; {out} has the run so far"
        )


def _for_its_duration(scene, out: Path, quiet: bool) -> None:
    from trackdyn.simulation.simulate import simulate as run

    if not quiet:
        console.decisions(scene)
    recording = run(scene, progress=not quiet)
    recording.save(out)  # before measures, which a short run may not have
    console.tension(scene, recording, quiet)
    console.remarks(recording, recording.resolution.reason)
    if not quiet:
        from trackdyn.measure.metrics import shown_measures

        console.load(recording)
        if len(recording.time) > 1:
            console.measures(recording, shown_measures(recording))
        else:
            console.warn(f"{out} has one sample, and no measures")


def _until_converged(scene, tolerances: dict[str, float], longest: float, free: bool, out: Path, quiet: bool) -> bool:
    """Record a scene until its measures are within ``tolerances`` (`planner.plan`); return whether they are."""
    from trackdyn.measure.planner import plan

    planned = plan(scene, tolerances, longest, free)
    if not quiet:
        console.plan(planned)
        console.decisions(planned.scene)
    answer = planned.run()
    answer.recording.save(out)
    console.tension(planned.scene, answer.recording, False)
    console.load(answer.recording)
    console.remarks(answer.recording)
    console.answer(answer)
    return answer.converged
