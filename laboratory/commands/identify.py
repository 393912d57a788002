"""The command ``trackdyn identify``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import (
    DEFAULT_RIG,
    AxisOption,
    Jobs,
    Mapping,
    Preset,
    Quiet,
    RigName,
    RingRadius,
    UnitOption,
    number,
    parse_axes,
)
from trackdyn.errors import InputError


def identify(
    records: Annotated[list[Path], typer.Argument(help="CSV of the sensor, one a speed: time and ay by name.")],
    unknown: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                "Parameter to identify, section.field or section.field=LOW:HIGH; repeatable. By default "
                "those that the records can tell."
            )
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("identified"),
    rig: RigName = DEFAULT_RIG,
    rpm: Annotated[
        list[float] | None,
        number("--rpm", "Motor speed of each record, rev/min; what its dominant peak says by default."),
    ] = None,
    ring_radius: RingRadius = None,
    preset: Preset = "standard",
    simulations: Annotated[
        int, typer.Option(help="Rigs of the first wave, a power of two; the second has half as many.")
    ] = 128,
    waves: Annotated[int, typer.Option(min=1, max=2, help="1: no rigs more where the first answer lies.")] = 2,
    steps: Annotated[
        int, typer.Option(min=100, max=10**6, help="Steps of the walkers that draw from the posterior.")
    ] = 3000,
    jobs: Jobs = None,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="The same seed gives the same draws.")] = 0,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on in a folder that is there: what was simulated is kept.")
    ] = False,
    synthetic: Annotated[
        str,
        typer.Option(help="What the records are called where they were not measured, such as synthetic or simulated."),
    ] = "",
    store: Annotated[
        Path | None, typer.Option(help="Folder in which simulations are kept; simulations in the output by default.")
    ] = None,
    mapping: Mapping = None,
    unit: UnitOption = None,
    axis: AxisOption = None,
    quiet: Quiet = False,
) -> None:
    """Identify parameters of the rig from records of the sensor, and say how sure that is.

    Example: `trackdyn identify 150rpm.csv 210rpm.csv --unknown bushing.stiffness` finds one value from two records.
    """
    from joblib import cpu_count

    from laboratory.inference.identification.identify import Settings
    from laboratory.inference.identification.informative import unknown_of
    from laboratory.inference.identification.measured import read_records
    from laboratory.report.identification import write_identification
    from trackdyn.files import check_writable
    from trackdyn.rig.rig import load_rig
    from trackdyn.sensor.sensor_mapping import load_mapping

    if simulations < 16 or simulations & (simulations - 1):
        raise InputError(f"--simulations = {simulations}: must be a power of two of at least 16, such as 128")
    settings, base = Settings(simulations, waves, steps, jobs or cpu_count(), seed, not quiet), load_rig(rig)
    radius = base.ring_radius if ring_radius is None else ring_radius.radius
    reading = load_mapping(mapping, unit=unit, axes=parse_axes(axis))
    measured = read_records(records, base, reading, rpm or [], radius, preset)
    unknowns = [unknown_of(text) for text in unknown or []]
    check_writable(out / "index.html")
    if out.exists() and any(out.iterdir()) and not resume:
        raise InputError(
            f"--out {out} already exists; use --resume to go on from its simulations, or choose another folder"
        )
    say = (lambda text: None) if quiet else typer.echo
    write_identification(measured, rig, unknowns, out, store or out / "simulations", settings, synthetic, say)
