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
    video: Annotated[Path | None, typer.Option(help="Film to write, too (.mp4); needs ffmpeg.")] = None,
    pace: Annotated[float, typer.Option(help="Seconds of the run in a second of the film.")] = 0.25,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")] = False,
) -> None:
    """Show a run on one page: the loop moving, tension, sensor, contacts, work, decisions; on request as a film.

    What moves is simulated again from the recording's scene, lead-in included.
    """
    out = recording.with_suffix(".html") if out is None else out
    for name, path, ending in (("--out", out, ".html"), ("--video", video, ".mp4")):
        if path is not None and path.suffix != ending:
            raise InputError(f"{name} = {shown(str(path))} is not accepted: a name that ends in {ending} would do")
    from trackdyn.files import refuse_unwritable
    from trackdyn.report.page.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    for path in filter(None, (out, video)):
        refuse_unwritable(path)
    if video is not None:
        from trackdyn.report.figures.video import refuse_no_film, write_video

        refuse_no_film(loaded, pace)
    page = make(loaded, out, seconds, recording.stem, progress=not quiet)
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB, {page.summary}")
    if video is not None:
        count = write_video(loaded, page.stretch, video, pace, progress=not quiet)
        if not quiet:
            typer.echo(f"{video}: {count} pictures")
