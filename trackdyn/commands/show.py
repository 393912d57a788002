"""The command ``trackdyn show``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import Quiet, RecordingFile, file_option, number


def show(
    recording: RecordingFile,
    out: Annotated[Path | None, file_option("--out", "Page to write; the recording's name by default", ".html")] = None,
    seconds: Annotated[
        float | None, number("--seconds", "Length of what moves, s; a turn of the sprocket by default.")
    ] = None,
    video: Annotated[Path | None, file_option("--video", "Film to write, too; needs ffmpeg", ".mp4")] = None,
    pace: Annotated[float, number("--pace", "Seconds of the run in a second of the film.")] = 0.25,
    quiet: Quiet = False,
) -> None:
    """Show a run on one page: the loop moving, tension, sensor, contacts, work, decisions; on request as a film.

    What moves is simulated again from the recording's scene, lead-in included.
    """
    from trackdyn.files import refuse_unwritable
    from trackdyn.report.page.show import show as make
    from trackdyn.simulation.recording import load_recording

    out = recording.with_suffix(".html") if out is None else out
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
