"""Commands of recordings: ``trackdyn show`` and ``trackdyn export``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.commands.own_files import noting
from trackdyn.inputs.errors import InputError


def show(
    recording: options.RecordingFile,
    out: Annotated[
        Path | None, options.file_option("--out", "Page to write; the recording's name by default", ".html")
    ] = None,
    seconds: Annotated[
        float | None, options.number("--seconds", "Length of the animation, s; a turn of the sprocket by default.")
    ] = None,
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
    sensor: Annotated[
        str | None, typer.Option("--sensor", metavar="NAME", help="Sensor of the rig; all of them by default.")
    ] = None,
    pitch: Annotated[
        list[int] | None, options.repeatable("--pitch", "PITCH", "Recorded pitch, from 1, whose contacts are added.")
    ] = None,
    contacts: Annotated[
        bool, typer.Option("--contacts", help="One row per contact instead: duration, groove, peak force, impulse.")
    ] = False,
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
