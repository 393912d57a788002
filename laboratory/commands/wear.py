"""The command ``trackdyn wear``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import (
    Overwrite,
    Preset,
    Quiet,
    RigArgument,
    RingRadius,
    SpeedOption,
    StepOption,
    file_option,
)


def wear(
    rig: RigArgument,
    out: Annotated[Path, file_option("--out", "Table to write: a row a state of the worn rig", ".parquet")],
    until: Annotated[str, typer.Option("--until", help="'ring 0.303 m' or 'distance 5000 km'.")],
    rpm: SpeedOption = 115.0,
    ring_radius: RingRadius = None,
    tension: Annotated[
        str | None, typer.Option("--tension", help="locked, retensioned or sprung; the rig's own by default.")
    ] = None,
    coefficients: Annotated[
        Path | None, typer.Option("--coefficients", help="YAML file of energy densities; the shipped one by default.")
    ] = None,
    preset: Preset = "standard",
    step: StepOption = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """The life of a rig: what wears, and what that changes, from the new part to a bound.

    The table is written after every step; the same command goes on from it.
    """
    from laboratory.wear.law import DEFAULT, load_coefficients
    from laboratory.wear.life import Worn, live, parse_until
    from trackdyn.parameters.rig import load_rig

    loaded, bound = load_rig(rig), parse_until(until)
    if ring_radius is not None:
        ring = (
            {"sprocket__ring": "none"} if ring_radius.radius is None else {"sprocket__ring_radius": ring_radius.radius}
        )
        loaded = loaded.changed(**ring)
    fields: dict = {"preset": preset} | ({} if step is None else {"step": step})
    fields |= {} if tension is None else {"tension": tension}
    worn = Worn(loaded, rpm, load_coefficients(coefficients or DEFAULT), fields)

    def say(row: dict) -> None:
        if not quiet:
            typer.echo(
                f"{row['distance_km']:10.0f} km  ring {1e3 * row['ring_radius_m']:.3f} mm  flanks "
                f"{1e3 * row['left_depth_m']:.3f} and {1e3 * row['right_depth_m']:.3f} mm  left "
                f"{row['left_share_pct']:4.1f} %  right {row['right_share_pct']:4.1f} %  RMS {row['rms_g']:.3f} g"
            )

    table = live(worn, bound, out=out, overwrite=overwrite, tick=say)
    typer.echo(f"{table['distance_km'].iloc[-1]:.0f} km: {table['end'].iloc[-1]}")
