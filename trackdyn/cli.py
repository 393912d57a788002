"""The ``trackdyn`` command."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError, TrackdynError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Simulate a double-pin track drive and compare it with a sensor.",
)


def _ring(text: str) -> float | None:
    if text == "none":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--ring-radius = {text!r} is not accepted: a radius in m or the word none would do") from None


def _choices(pairs: list[str]) -> dict:
    from trackdyn.fidelity import CHOICES

    found = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        if name == "tolerance":
            try:
                found[name] = float(value)
            except ValueError:
                raise InputError(f"--choose {pair} is not accepted: tolerance=1e-6, a number, would do") from None
        elif name not in CHOICES or not value:
            raise InputError(f"--choose {pair} is not accepted: name=setting with one of {', '.join(CHOICES)} would do")
        else:
            found[name] = value
        if (name, value) in (("chain", "belt"), ("loop", "free")):
            found |= {"ring_radius": None, "spells": False}
    return found


@app.command()
def simulate(
    out: Annotated[Path, typer.Argument(help="Recording to write (.npz).")],
    rig: Annotated[Path, typer.Option(help="Parameters of the rig.")] = Path("config/rig.yaml"),
    rpm: Annotated[float, typer.Option(help="Motor speed, rev/min.")] = 115.0,
    ring_radius: Annotated[str, typer.Option(help="Radius of the rubber ring in m, or none.")] = "0.308",
    duration: Annotated[float, typer.Option(help="Recorded time, s.")] = 20.0,
    lead_in: Annotated[float, typer.Option(help="Time at constant speed before the record, s.")] = 5.0,
    preset: Annotated[str, typer.Option(help="Bundle of choices: fast, standard, paper or reference.")] = "standard",
    step: Annotated[float | None, typer.Option(help="Time step, s; the preset's by default.")] = None,
    choose: Annotated[
        list[str] | None,
        typer.Option("--choose", help="One choice of fidelity, such as chain=single_pin; may be given several times."),
    ] = None,
    frame_interval: Annotated[float, typer.Option(help="Time between recorded configurations, s; 0: none.")] = 0.05,
    rate: Annotated[
        int | None, typer.Option(help="Samples a second, Hz, such as your sensor's; the rig's by default. The step adapts.")
    ] = None,
    checkpoint: Annotated[
        Path | None, typer.Option(help="File kept while a long run records; the same command goes on from it.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")] = False,
) -> None:
    """Run one scene and write its recording."""
    from trackdyn.fidelity import preset as preset_fields
    from trackdyn.measure.metrics import run_metrics
    from trackdyn.parameters.rig import load_rig
    from trackdyn.scene import Scene
    from trackdyn.simulate import simulate as run

    if out.suffix != ".npz":
        raise InputError(f"OUT = {out} is not accepted: a name that ends in .npz would do")
    fields = {"ring_radius": _ring(ring_radius)} | preset_fields(preset)
    fields |= ({} if step is None else {"step": step}) | _choices(choose or [])
    scene = Scene(
        load_rig(rig),
        motor_rpm=rpm,
        duration=duration,
        lead_in=lead_in,
        frame_interval=frame_interval,
        **fields,
    )
    if rate is not None:
        scene = scene.sampled(rate)
    if not quiet:
        for name, decision in scene.fidelity.items():
            typer.echo(f"{name:>22}  {decision.setting}: {decision.reason}")
    recording = run(scene, progress=not quiet, checkpoint=checkpoint)
    recording.save(out)
    if not quiet:
        for name, value in run_metrics(out.stem, recording).items():
            if value == value:  # what a run cannot have is left out
                typer.echo(f"{name:>22}  {value:.6g}" if isinstance(value, float) else f"{name:>22}  {value}")


@app.command()
def compare(
    recording: Annotated[Path, typer.Argument(help="Recording made by `trackdyn simulate` (.npz).")],
    sensor: Annotated[Path, typer.Argument(help="CSV of the sensor: columns of time, ax, ay and az by name.")],
    mapping: Annotated[Path | None, typer.Option(help="YAML file with the options below.")] = None,
    time: Annotated[str | None, typer.Option(help="Column of the time stamps, or none (with --rate).")] = None,
    rate: Annotated[float | None, typer.Option(help="Samples a second, Hz; found from the stamps by default.")] = None,
    unit: Annotated[str | None, typer.Option(help="g, m/s2 or mg, where the header says none.")] = None,
    axis: Annotated[
        list[str] | None, typer.Option(help="Which column an axis is, such as ay=channel3 or ay=-channel3; repeatable.")
    ] = None,
    sensor_range: Annotated[float | None, typer.Option("--range", help="Range of the sensor, g; the rig's by default.")] = None,
    resample: Annotated[bool, typer.Option("--resample", help="Put samples whose stamps jitter onto even instants.")] = False,
    start: Annotated[float | None, typer.Option("--from", help="First instant to keep, s since the first row.")] = None,
    to: Annotated[float | None, typer.Option("--to", help="Last instant to keep, s since the first row.")] = None,
) -> None:
    """Compare the simulated y acceleration with a sensor's: RMS, SD and main line."""
    from trackdyn.measure.compare import compare_with_sensor
    from trackdyn.measure.sensor_csv import read_sensor_csv
    from trackdyn.measure.sensor_mapping import load_mapping
    from trackdyn.recording import load_recording

    for pair in axis or []:
        if not all(pair.partition("=")):
            raise InputError(f"--axis {pair} is not accepted: an axis and its column, such as ay=channel3, would do")
    axes = dict(pair.split("=", 1) for pair in axis or [])
    chosen = load_mapping(
        mapping, time=time, rate=rate, unit=unit, axes=axes, range=sensor_range, resample=resample, to=to, **{"from": start}
    )
    loaded = load_recording(recording)
    rig = loaded.meta["rig"]
    record = read_sensor_csv(sensor, chosen, range_g=rig["sensor"]["range"], gravity=rig["gravity"] or 9.81)
    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(loaded, record, str(recording))
    typer.echo("\n" + table.to_string(index=False, float_format=lambda v: f"{v:.4f}", na_rep="-"))
    if "line_hz" not in set(table.measure):
        typer.echo("trackdyn: warning: no line, for which both records must hold two turns of the loop", err=True)


@app.command()
def plan(
    tolerance: Annotated[str, typer.Option(help="What the measure may be off, such as 2% or 0.02.")],
    measure: Annotated[
        str, typer.Option(help="rms, sd, line, left_peak, left_share, right_share or ring_share.")
    ] = "rms",
    rpm: Annotated[float, typer.Option(help="Motor speed, rev/min.")] = 115.0,
    ring_radius: Annotated[str, typer.Option(help="Radius of the rubber ring in m, or none.")] = "0.308",
    data: Annotated[Path | None, typer.Option(help="Measured data; results/trade.csv or the short form.")] = None,
) -> None:
    """The cheapest fidelity and step that kept a tolerance where it was measured."""
    from trackdyn.study.accuracy.planner import load_trade
    from trackdyn.study.accuracy.planner import plan as choose

    chosen = choose(load_trade(data), tolerance, measure, rpm, _ring(ring_radius))
    for name, value in chosen.fields.items():
        typer.echo(f"{name:>22}  {value}")
    typer.echo(f"{'expected error':>22}  {chosen.expected_error:.2g}")
    typer.echo(f"{'expected cost':>22}  {chosen.wall_s_per_s:.3g} s per simulated second on the machine that measured")
    for warning in chosen.warnings:
        typer.echo(f"trackdyn: warning: {warning}; the plan is a guess there", err=True)


def main() -> None:
    """Entry point: a user's mistake ends in one sentence and exit code 1."""
    try:
        app()
    except TrackdynError as error:
        print(f"trackdyn: {error}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        print(f"trackdyn: {error.filename}: {error.strerror}; give a path that can be written", file=sys.stderr)
        sys.exit(1)
