"""The command ``trackdyn identify``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError
from trackdyn.parameters.validation import shown


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
    rig: Annotated[Path, typer.Option(help="Everything that is known of the rig, and the ranges of the rest.")] = Path(
        "config/rig.yaml"
    ),
    rpm: Annotated[
        list[float] | None,
        typer.Option(help="Motor speed of each record, rev/min; what its main line says by default."),
    ] = None,
    ring_radius: Annotated[
        str | None, typer.Option(help="Radius of the rubber ring in m, or none; the rig's by default.")
    ] = None,
    preset: Annotated[
        str, typer.Option(help="Fidelity of the simulations: fast, standard, paper or reference.")
    ] = "standard",
    simulations: Annotated[
        int, typer.Option(help="Rigs of the first wave, a power of two; the second has half as many.")
    ] = 128,
    waves: Annotated[int, typer.Option(min=1, max=2, help="1: no rigs more where the first answer lies.")] = 2,
    steps: Annotated[int, typer.Option(help="Steps of the walkers that draw from the posterior.")] = 3000,
    jobs: Annotated[int | None, typer.Option("--jobs", "-j", help="Processes; all cores by default.")] = None,
    seed: Annotated[int, typer.Option(help="The same seed gives the same draws.")] = 0,
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
    mapping: Annotated[
        Path | None, typer.Option(help="YAML file that says how to read the records, as for compare.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="g, m/s2 or mg, where the header says none.")] = None,
    axis: Annotated[
        list[str] | None, typer.Option(help="Which column an axis is, such as ay=channel3; repeatable.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars and no summary.")] = False,
) -> None:
    """Identify parameters of the rig from records of the sensor, and say how sure that is."""
    from trackdyn.files import refuse_unwritable, write_csv
    from trackdyn.inference.identification.answer import write_answer
    from trackdyn.inference.identification.experiment import scene_of
    from trackdyn.inference.identification.identify import Settings
    from trackdyn.inference.identification.identify import identify as run
    from trackdyn.inference.identification.informative import asked, tellable, unknown_of
    from trackdyn.inference.identification.measured import read_records
    from trackdyn.parameters.rig import load_rig
    from trackdyn.report.page.identification import headline, write_page
    from trackdyn.sensor.sensor_mapping import load_mapping
    from trackdyn.sweeps.sweep import cores

    if simulations < 16 or simulations & (simulations - 1):
        raise InputError(
            f"--simulations = {simulations} is not accepted: a power of two from 16 on would do, such as 128"
        )
    if steps < 100:
        raise InputError(f"--steps = {steps} is not accepted: 100 or more would do")
    if jobs is not None and not 1 <= jobs <= 1024:
        raise InputError(f"--jobs = {jobs} is not accepted: a whole number of 1 to 1024 would do")
    for pair in axis or []:
        if not all(pair.partition("=")):
            raise InputError(f"--axis {pair} is not accepted: an axis and its column, such as ay=channel3, would do")
    base = load_rig(rig)
    axes = dict(pair.split("=", 1) for pair in axis or [])
    measured = read_records(
        records, base, load_mapping(mapping, unit=unit, axes=axes), rpm or [], _radius(ring_radius, base), preset
    )
    for one in measured:
        scene_of(base, one.speed, one.turn_s)  # what cannot be simulated is refused before all else
    unknowns = asked([unknown_of(text) for text in unknown or []], base, rig)
    refuse_unwritable(out / "index.html")
    if out.exists() and any(out.iterdir()) and not resume:
        raise InputError(
            f"--out {out} is there already; --resume to go on from its simulations, or another folder, would do"
        )
    store = store or out / "simulations"
    settings = Settings(simulations, waves, steps, jobs or cores(), seed, not quiet)

    def say(text: str) -> None:
        if not quiet:
            typer.echo(text)

    for one in measured:
        say(f"{one.record.path}: {len(one.statistics)} turns of the loop at {one.speed.rpm:.5g} rev/min")
    found = None
    if not unknowns.unknowns:
        chosen, found = tellable(measured, base, rig, store, settings.jobs, settings.progress)
        unknowns = asked(chosen, base, rig)
    for one in unknowns.unknowns:
        say(
            f"unknown: {one.label} within {one.low:g} to {one.high:g}, even in "
            f"{'its logarithm' if one.scale == 'log' else 'itself'}"
        )
    answer = run(measured, unknowns, store, settings, say)
    best = write_answer(answer, rig, out)
    if found is not None:
        write_csv(out / "tellable.csv", found)
    page = write_page(answer, best, out, synthetic, found)
    say(answer.table.drop(columns=["scale"]).to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    say(headline(answer))
    say(f"written: {page}")


def _radius(text: str | None, rig) -> float | None:
    if text is None:
        return rig.sprocket.ring_radius
    if text == "none":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(
            f"--ring-radius = {shown(text)} is not accepted: a radius in m or the word none would do"
        ) from None
