"""The command ``trackdyn fmu``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import (
    Overwrite,
    Preset,
    RigArgument,
    RingRadius,
    SpeedOption,
    StepOption,
    check_output,
    file_option,
    number,
    scene_fields,
)


def fmu(
    rig: RigArgument,
    out: Annotated[Path, file_option("--out", "Unit to write", ".fmu")] = Path("track.fmu"),
    rpm: SpeedOption = 115.0,
    ring_radius: RingRadius = None,
    lead_in: Annotated[
        float, number("--lead-in", "Time at speed before time 0, s; 0: the loop rests at time 0.")
    ] = 0.0,
    preset: Preset = "standard",
    step: StepOption = None,
    tension: Annotated[
        str | None, typer.Option(help="locked, retensioned, sprung or forced; the rig's by default.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a track as a unit for co-simulation (FMI 3.0), which begins at the motor speed --rpm.

    Example: `trackdyn fmu vehicle --out track.fmu` packs the included rig `vehicle` for another simulator.
    """
    from laboratory.fmi.build import write_fmu
    from trackdyn.rig.rig import load_rig
    from trackdyn.scene.choices import preset as preset_fields
    from trackdyn.scene.scene import Scene

    check_output(out, overwrite, rig)
    requested = {name: value for name, value in {"step": step, "tension": tension}.items() if value is not None}
    loaded, ring = load_rig(rig), scene_fields(ring_radius)
    fields = preset_fields(preset, ring.get("ring_radius", loaded.ring_radius) is not None) | requested | ring
    scene = Scene(loaded, rpm, lead_in=lead_in, **fields)
    unit = write_fmu(scene, out)
    for kind, signals in (("in", unit.inputs), ("out", unit.outputs)):
        for signal in signals:
            typer.echo(f"{kind:>4}  {signal.name} ({signal.unit}): {signal.text}")
    typer.echo(f"{out}: written; who imports it needs a Python in which trackdyn is installed")
