"""The command of a recording: ``trackdyn show``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.commands.own_files import noting


def show(
    recording: options.RecordingFile,
    out: Annotated[
        Path | None, options.file_option("--out", "Page to write; the recording's name by default", ".html")
    ] = None,
    seconds: Annotated[
        float | None, options.number("--seconds", "Length of what moves, s; a turn of the sprocket by default.")
    ] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a run on one page.

    It has the loop in motion, tension, sensor, contacts, energy and choices. What moves is simulated again from the
    recording's scene, lead-in included.

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
