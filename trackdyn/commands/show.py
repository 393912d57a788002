"""The command ``trackdyn show``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError
from trackdyn.parameters.validation import shown


def show(
    recording: Annotated[Path, typer.Argument(help="Recording made by `trackdyn simulate` (.npz).")],
    out: Annotated[Path | None, typer.Option(help="Page to write (.html); the recording's name by default.")] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Length of what moves, s; a turn of the sprocket by default.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")] = False,
) -> None:
    """Show a run on one page: the loop moving, tension, sensor, contacts, work, decisions.

    What moves is simulated again from the recording's scene, lead-in included.
    """
    out = recording.with_suffix(".html") if out is None else out
    if out.suffix != ".html":
        raise InputError(f"--out = {shown(str(out))} is not accepted: a name that ends in .html would do")
    from trackdyn.files import refuse_unwritable
    from trackdyn.report.page.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    refuse_unwritable(out)
    page = make(loaded, out, seconds, recording.stem, progress=not quiet)
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB, {page.summary}")
