"""The command ``trackdyn plan``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import MEASURE, Ring, RingRadius, SpeedOption, Tolerance


def plan(
    tolerance: Tolerance,
    measure: Annotated[str, MEASURE] = "rms",
    rpm: SpeedOption = 115.0,
    ring_radius: RingRadius = Ring(0.308),
    data: Annotated[Path | None, typer.Option(help="Measured data; results/trade.csv or the short form.")] = None,
) -> None:
    """The cheapest fidelity, step and duration that keep a tolerance, by what was measured."""
    from replication.study.accuracy.planner import LEAD_IN, load_trade
    from replication.study.accuracy.planner import plan as choose

    chosen = choose(load_trade(data), tolerance, measure, rpm, ring_radius.radius)
    for name, value in chosen.fields.items():
        typer.echo(f"{name:>22}  {value}")
    typer.echo(
        f"{'duration':>22}  {chosen.duration:g} s of every link, after {LEAD_IN:g} s at constant "
        f"speed: {chosen.passages} passages"
    )
    typer.echo(
        f"{'expected error':>22}  {chosen.of_setting:.2g} of the setting, {chosen.of_record:.2g} of the record at most"
    )
    typer.echo(f"{'expected cost':>22}  {chosen.cpu_s:.3g} CPU seconds on the machine that measured")
    for warning in chosen.warnings:
        typer.echo(f"trackdyn: warning: {warning}; the plan is a guess there", err=True)
