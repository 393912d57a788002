"""The commands about rigs: ``trackdyn check``, ``trackdyn new`` and ``trackdyn rigs``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.errors import TrackdynError


def rigs() -> None:
    """List the rigs of the package."""
    from trackdyn.parameters.rig_file import DEFAULT, shipped_summaries

    for name, (counts, about) in shipped_summaries().items():
        typer.echo(f"{name:>22}  {counts}{', used where none is named' if name == DEFAULT else ''}\n{'':>22}  {about}")


def new(
    out: Annotated[Path, options.file_argument("File to write", ".yaml", ".yml")],
    like: Annotated[str, typer.Option(help="Shipped rig that it begins with (trackdyn rigs).")] = "bench",
    overwrite: options.Overwrite = False,
) -> None:
    """Write a rig file to edit: the wheels and the tension of a shipped rig, and all else as comments."""
    from trackdyn.files import write_text
    from trackdyn.parameters.rig_template import rig_text

    text = rig_text(like)
    options.check_output(out, overwrite)
    write_text(out, text)
    typer.echo(f"{out}: edit it, then  trackdyn check {out}  and  trackdyn simulate run.npz --rig {out}")


def check(
    rig: options.RigArgument,
    out: Annotated[
        Path | None,
        options.file_option("--out", "Picture to write, with an .svg beside it; by default named like the rig", ".png"),
    ] = None,
    rpm: options.SpeedOption = 115.0,
    settle: Annotated[
        bool, typer.Option("--settle/--no-settle", help="Tension the loop and let it come to rest.")
    ] = True,
    overwrite: options.Overwrite = False,
) -> None:
    """Lay a rig's loop, draw it, and say how the chain wraps, which step it allows and what is unusual."""
    from trackdyn.parameters.rig import load_rig
    from trackdyn.parameters.rig_file import groove_origin
    from trackdyn.plots.drawing import draw_rig
    from trackdyn.plots.style import save
    from trackdyn.simulation.rig_check import OTHER_TOOTH, checked, pitch_of

    loaded = load_rig(rig)
    out = out or Path(f"{Path(rig).stem}.png")
    for path in (out, out.with_suffix(".svg")):
        options.check_output(path, overwrite, rig)
    if settle:
        typer.echo("settling; kernels that are not compiled yet take a minute or two more", err=True)
    try:
        checks = checked(loaded, rpm, settle)
    except TrackdynError as error:
        raise type(error)(f"{rig}: {error}") from None
    if origin := groove_origin(rig):
        other = load_rig(origin)
        both = [(of.sprocket.teeth, pitch_of(of), of.chain.connector_radius) for of in (other, loaded)]
        if any(abs(here / there - 1) > OTHER_TOOTH for there, here in zip(*both, strict=True)):
            theirs, ours = ("{} teeth, pitch {:.4g} m, arcs of {:.3g} m".format(*of) for of in both)
            name = Path(origin).stem
            checks.unusual.append(
                f"the groove is that of {name} ({theirs}), this rig has {ours}: state groove or profile"
            )
    save(draw_rig(loaded, checks.frame, checks.wheels), out)
    remarks = [("unusual", text) for text in checks.unusual or ["nothing"]]
    for name, text in (*checks.values.items(), *remarks, ("picture", out)):
        typer.echo(f"{name:>22}  {text}")
