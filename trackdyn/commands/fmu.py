"""The command ``trackdyn fmu``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError
from trackdyn.parameters.validation import shown


def fmu(
    rig: Annotated[str, typer.Argument(help="Rig: a file, or the name of a shipped one (trackdyn rigs).")],
    out: Annotated[Path, typer.Option(help="Unit to write (.fmu).")] = Path("track.fmu"),
    rpm: Annotated[float, typer.Option(help="Motor speed at the start, rev/min.")] = 115.0,
    ring_radius: Annotated[
        str | None, typer.Option(help="Radius of the rubber ring in m, or none; the rig's by default.")
    ] = None,
    lead_in: Annotated[float, typer.Option(help="Time at speed before time 0, s; 0: the loop rests at time 0.")] = 0.0,
    preset: Annotated[str, typer.Option(help="Bundle of choices: fast, standard, paper or reference.")] = "standard",
    step: Annotated[float | None, typer.Option(help="Time step, s; the preset's by default.")] = None,
    tension: Annotated[
        str | None, typer.Option(help="locked, retensioned, sprung or forced; the rig's by default.")
    ] = None,
) -> None:
    """Write a track as a unit for co-simulation (FMI 3.0)."""
    from trackdyn.files import refuse_unwritable
    from trackdyn.fmi.build import write_fmu
    from trackdyn.parameters.rig import load_rig
    from trackdyn.scene.fidelity import preset as preset_fields
    from trackdyn.scene.scene import Scene

    if out.suffix != ".fmu":
        raise InputError(f"--out = {shown(str(out))} is not accepted: a name that ends in .fmu would do")
    refuse_unwritable(out)
    asked = {"step": step, "tension": tension}
    fields = preset_fields(preset) | {name: value for name, value in asked.items() if value is not None}
    if ring_radius is not None:
        try:
            fields["ring_radius"] = None if ring_radius == "none" else float(ring_radius)
        except ValueError:
            raise InputError(
                f"--ring-radius = {shown(ring_radius)} is not accepted: a radius in m or the word none would do"
            ) from None
    scene = Scene(load_rig(rig), rpm, lead_in=lead_in, **fields)
    unit = write_fmu(scene, out)
    for kind, signals in (("in", unit.inputs), ("out", unit.outputs)):
        for signal in signals:
            typer.echo(f"{kind:>4}  {signal.name} ({signal.unit}): {signal.text}")
    typer.echo(f"{out}: written; who imports it needs a Python in which trackdyn is installed")
