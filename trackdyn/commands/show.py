"""The command ``trackdyn show``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import Overwrite, Quiet, RecordingFile, check_output, file_option, number


def show(
    recording: RecordingFile,
    out: Annotated[Path | None, file_option("--out", "Page to write; the recording's name by default", ".html")] = None,
    seconds: Annotated[
        float | None, number("--seconds", "Length of what moves, s; a turn of the sprocket by default.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Show a run on one page: the loop moving, tension, sensor, contacts, work, decisions.

    What moves is simulated again from the recording's scene, lead-in included.
    """
    from trackdyn.plots.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    out = recording.with_suffix(".html") if out is None else out
    check_output(out, overwrite, recording)
    page = make(loaded, out, seconds, recording.stem, progress=not quiet)
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB, {page.summary}")
