"""Commands of recordings: ``trackdyn simulate``, ``trackdyn show`` and ``trackdyn export``."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from trackdyn.commands import console, options
from trackdyn.commands.own_files import noting
from trackdyn.inputs.errors import InputError, shown

_LEAD_IN = "Time at constant speed before the record, s; after 1 s of start-up."
_PAGE = "Page to write; the recording's name by default"
_SECONDS = "Length of the animation, s; a turn of the sprocket by default."
_SENSOR = "Sensor of the rig; all of them by default."
_PITCHES = "Recorded pitch, from 1, whose contacts are added."
_CONTACTS = "One row per contact instead: duration, groove, peak force, impulse."


def simulate(
    out: Annotated[Path, options.file_argument("Recording to write", ".npz")],
    rig: options.RigName = options.DEFAULT_RIG,
    rpm: options.SpeedOption = 115.0,
    ring_radius: options.RingRadius = None,
    load: options.Load = None,
    duration: Annotated[float, options.number("--duration", "Recorded time, s.")] = 20.0,
    lead_in: Annotated[float, options.number("--lead-in", _LEAD_IN)] = 5.0,
    preset: options.Preset = None,
    step: options.StepOption = None,
    choose: options.Choose = None,
    tolerance: options.Tolerance = None,
    measure: options.Measures = None,
    longest: options.LongestRun = 60.0,
    rate: options.Rate = None,
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
    from trackdyn.scene.choices import CHOICES
    from trackdyn.scene.scene import Scene

    if measure and tolerance is None:
        raise InputError("--measure needs --tolerance, such as --tolerance 1%")
    loaded = load_rig(rig) if rate is None else load_rig(rig).sampled(rate)
    stated = {"ring_radius": ring_radius, "step": step, "pitches": pitch or None, "load": load}
    fields: dict[str, Any] = {name: value for name, value in stated.items() if value is not None}
    if ring_radius != ring_radius:
        fields["ring_radius"] = None
    for pair in choose or []:
        name, _, value = pair.partition("=")
        if name not in CHOICES or not value:
            names = ", ".join(CHOICES)
            raise InputError(f"--choose = {shown(pair)}: expected name=setting with one of the names {names}")
        fields[name] = value
        if (name, value) == ("chain", "belt"):
            fields |= {"ring_radius": None, "contact_log": False}
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
    from trackdyn.measure.planner import plan

    free = preset is None and not {"step", "integrator"} & fields.keys()
    planned = plan(scene, dict.fromkeys(measure or ["rms"], tolerance), longest, free)
    if not quiet:
        console.plan(planned)
        console.decisions(planned.scene)
    answer = planned.run()
    answer.recording.save(out)
    console.tension(planned.scene, answer.recording, False)
    console.load(answer.recording)
    console.remarks(answer.recording)
    console.answer(answer)
    if not answer.converged:
        short = f"--longest = {longest:g} s is too short for --tolerance {tolerance:g}"
        raise InputError(f"{short}; {out} has the run so far")


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


def show(
    recording: options.RecordingFile,
    out: Annotated[Path | None, options.file_option("--out", _PAGE, ".html")] = None,
    seconds: Annotated[float | None, options.number("--seconds", _SECONDS)] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a run on one page.

    It has an animation of the loop, tension, sensor, contacts, energy and choices. The animation is simulated again
    from the recording's scene, lead-in included.

    Example: `trackdyn show run.npz` writes run.html, which any browser opens.
    """
    from trackdyn.plots.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    out = recording.with_suffix(".html") if out is None else out
    options.check_output(out, overwrite, recording)
    with noting([recording], out):
        page = make(loaded, out, seconds, recording.stem, progress=not quiet)
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB")


def export(
    recording: options.RecordingFile,
    out: Annotated[Path, options.file_argument("Table to write", ".csv", ".mat")],
    sensor: Annotated[str | None, typer.Option("--sensor", metavar="NAME", help=_SENSOR)] = None,
    pitch: Annotated[list[int] | None, options.repeatable("--pitch", "PITCH", _PITCHES)] = None,
    contacts: Annotated[bool, typer.Option("--contacts", help=_CONTACTS)] = False,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a recording as a table for other programs.

    It has time and the sensor's axes (Eq. 40), names with units, and a comment on rig and scene. The ending selects
    CSV or MATLAB's .mat.

    Example: `trackdyn export run.npz run.csv` writes a table that a spreadsheet, pandas and `trackdyn compare` read.
    """
    from trackdyn.measure.export import export as write
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    if contacts and sensor is not None:
        raise InputError(f"--sensor {sensor}: contacts are of pitches; leave out --sensor or --contacts")
    selection = (f"export {sensor} {pitch} {contacts}",)  # one value: another selection is another table
    options.check_output(out, overwrite, recording, selection)
    with noting([recording, selection], out):
        table = write(loaded, out, sensor, pitch or (), contacts)
    if not quiet:
        typer.echo(f"{out}: {len(table)} rows of {', '.join(table.columns[:8])}{', ...' * (len(table.columns) > 8)}")
