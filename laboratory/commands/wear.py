"""The command ``trackdyn wear``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.commands.options import Overwrite, Preset, Quiet, RigArgument, RingRadius, SpeedOption, StepOption


def wear(
    rig: RigArgument,
    out: Annotated[Path, options.file_option("--out", "Table to write: a row a state of the worn rig", ".parquet")],
    until_radius: Annotated[float | None, options.number("--until-radius", "Ring radius of the end, m.")] = None,
    until_distance: Annotated[float, options.number("--until-distance", "Distance of the end, km.")] = 10_000.0,
    rpm: SpeedOption = 115.0,
    ring_radius: RingRadius = None,
    tension: Annotated[str | None, typer.Option(help="locked, retensioned or sprung; the rig's by default.")] = None,
    coefficients: Annotated[Path | None, typer.Option(help="YAML file; the shipped one by default.")] = None,
    preset: Preset = "standard",
    step: StepOption = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """The life of a rig: what wears, and what that changes, from the new ring to a radius or a distance."""
    from laboratory.wear.law import DEFAULT, load_coefficients
    from laboratory.wear.life import Worn, live
    from trackdyn.parameters.rig import load_rig
    from trackdyn.sweeps.design import write_table

    options.check_output(out, overwrite, rig, coefficients)
    loaded = load_rig(rig)
    if ring_radius is not None:
        new = (
            {"sprocket__ring": "none"} if ring_radius.radius is None else {"sprocket__ring_radius": ring_radius.radius}
        )
        loaded = loaded.changed(**new)
    fields = {"preset": preset, "step": step, "tension": tension}
    fields = {name: value for name, value in fields.items() if value is not None}
    worn = Worn(loaded, rpm, load_coefficients(coefficients or DEFAULT), fields)

    def show(row: dict) -> None:
        if not quiet:
            typer.echo(
                f"{row['distance_km']:10.0f} km  ring {1e3 * row['ring_radius_m']:.3f} mm  flanks "
                f"{1e3 * row['left_depth_m']:.3f} and {1e3 * row['right_depth_m']:.3f} mm  left "
                f"{row['left_share_pct']:4.1f} %  right {row['right_share_pct']:4.1f} %  RMS {row['rms_g']:.3f} g"
            )

    table = live(worn, until_radius, 1e3 * until_distance, show)
    write_table(table, out)
    typer.echo(f"{table['distance_km'].iloc[-1]:.0f} km: {table['end'].iloc[-1]}")
