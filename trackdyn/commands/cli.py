"""The ``trackdyn`` command."""

import os
import sys
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import rig as rig_commands
from trackdyn.commands import sweep as commands
from trackdyn.commands.choose_ring import choose_ring
from trackdyn.commands.fmu import fmu
from trackdyn.commands.identify import identify
from trackdyn.commands.show import show
from trackdyn.errors import InputError, TrackdynError
from trackdyn.parameters.validation import shown

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Simulate a double-pin track drive and compare it with a sensor.",
)


for command in (
    commands.sweep,
    commands.design,
    rig_commands.rigs,
    rig_commands.new,
    rig_commands.check,
    show,
    fmu,
    choose_ring,
    identify,
):
    app.command()(command)


def _number(option: str, text: str, remedy: str = "a finite number would do") -> float:
    try:
        if isfinite(number := float(text)):
            return number
    except ValueError:
        pass
    raise InputError(f"{option} = {shown(text)} is not accepted: {remedy}")


def _ring(text: str) -> float | None:
    return None if text == "none" else _number("--ring-radius", text, "a radius in m or the word none would do")


def _choices(pairs: list[str]) -> dict:
    from trackdyn.scene.fidelity import CHOICES

    found = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        if name == "tolerance":
            found[name] = _number("--choose tolerance", value, "a number such as 1e-6 would do")
        elif name not in CHOICES or not value:
            raise InputError(
                f"--choose = {shown(pair)} is not accepted: name=setting with one of {', '.join(CHOICES)} would do"
            )
        else:
            found[name] = value
        if (name, value) in (("chain", "belt"), ("loop", "free")):
            found |= {"ring_radius": None, "spells": False}
    return found


@app.command()
def simulate(
    out: Annotated[Path, typer.Argument(help="Recording to write (.npz).")],
    rig: Annotated[str, typer.Option(help="Rig: a file, or the name of a shipped one (trackdyn rigs).")] = "paper",
    rpm: Annotated[str, typer.Option(metavar="NUMBER", help="Motor speed, rev/min.")] = "115",
    ring_radius: Annotated[
        str | None, typer.Option(help="Radius of the rubber ring in m, or none; the rig's by default.")
    ] = None,
    duration: Annotated[str, typer.Option(metavar="NUMBER", help="Recorded time, s.")] = "20",
    lead_in: Annotated[str, typer.Option(metavar="NUMBER", help="Time at constant speed before the record, s.")] = "5",
    preset: Annotated[str, typer.Option(help="Bundle of choices: fast, standard, paper or reference.")] = "standard",
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Time step, s; the preset's by default.")] = None,
    choose: Annotated[
        list[str] | None,
        typer.Option("--choose", help="One choice of fidelity, such as chain=single_pin; may be given several times."),
    ] = None,
    frame_interval: Annotated[
        str, typer.Option(metavar="NUMBER", help="Time between recorded configurations, s; 0: none.")
    ] = "0.05",
    tolerance: Annotated[
        str | None,
        typer.Option(
            help=(
                "Record until every --measure is known to so much, whatever --duration: 1% of it, of a "
                "sprocket turn for shares."
            )
        ),
    ] = None,
    measure: Annotated[
        list[str] | None,
        typer.Option(help="rms, sd, line, left_peak, left_share, right_share or ring_share; may be repeated."),
    ] = None,
    longest: Annotated[str, typer.Option(metavar="NUMBER", help="Bound of a run with a --tolerance, s.")] = "60",
    rate: Annotated[
        str | None,
        typer.Option(
            metavar="NUMBER", help="Samples a second, Hz, such as your sensor's; the rig's by default. The step adapts."
        ),
    ] = None,
    checkpoint: Annotated[
        Path | None, typer.Option(help="File kept while a long run records; the same command goes on from it.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")] = False,
) -> None:
    """Run one scene and write its recording; a file of that name is replaced when the run is done."""
    from tqdm import tqdm

    from trackdyn.files import keep, refuse_unwritable
    from trackdyn.jit import announce
    from trackdyn.measure.metrics import run_metrics
    from trackdyn.parameters.rig import load_rig
    from trackdyn.scene.fidelity import preset as preset_fields
    from trackdyn.scene.scene import Scene
    from trackdyn.simulation.cost import needs
    from trackdyn.simulation.simulate import simulate as run

    if out.suffix != ".npz":
        raise InputError(f"OUT = {shown(str(out))} is not accepted: a name that ends in .npz would do")
    fields = ({} if ring_radius is None else {"ring_radius": _ring(ring_radius)}) | preset_fields(preset)
    fields |= ({} if step is None else {"step": _number("--step", step)}) | _choices(choose or [])
    scene = Scene(
        load_rig(rig),
        motor_rpm=_number("--rpm", rpm),
        duration=_number("--duration", duration),
        lead_in=_number("--lead-in", lead_in),
        frame_interval=_number("--frame-interval", frame_interval),
        **fields,
    )
    if rate is not None:
        scene = scene.sampled(_number("--rate", rate))
    needed = needs(scene)
    for path in (out, checkpoint):
        if path is not None:
            refuse_unwritable(path, needed.file)
    if not quiet:
        for name, decision in scene.fidelity.items():
            typer.echo(f"{name:>22}  {decision.setting}: {decision.reason}")
        typer.echo(f"{'needs':>22}  {needed}, more if kernels must be compiled")
    if measure and tolerance is None:
        raise InputError("--measure is not accepted without --tolerance: --tolerance 1% would do")
    if checkpoint is not None:
        if tolerance is not None:
            raise InputError(
                "--checkpoint is not accepted with --tolerance: such a run ends by itself; leave one of them out"
            )
        keep(checkpoint)
    if out.exists():
        typer.echo(
            f"trackdyn: warning: {out} exists and is replaced when the run is done; until then Ctrl-C keeps it",
            err=True,
        )
    if not quiet:
        announce(lambda text: tqdm.write(f"trackdyn: {text}", file=sys.stderr))  # above a bar
    if tolerance is not None:
        from trackdyn.measure.until_known import run_until
        from trackdyn.parameters.validation import parse_tolerance

        answer = run_until(
            scene, dict.fromkeys(measure or ["rms"], parse_tolerance(tolerance)), _number("--longest", longest)
        )
        answer.recording.save(out)
        for name, found in answer.measures.items():
            said = "" if name not in answer.reached else "known" if answer.reached[name] else "tolerance not reached"
            typer.echo(f"{name:>22}  {found.value:.6g} +- {found.half_width:.2g}  {said}")
        typer.echo(
            f"{'left out, recorded (s)':>22}  {answer.transient:.3g}, "
            f"{len(answer.recording.time) / answer.recording.rate:.4g}"
        )
        if not answer.known:
            raise InputError(
                f"--longest = {longest} s is too short for --tolerance {tolerance}; what was reached "
                f"is written to {out}"
            )
        return
    recording = run(scene, progress=not quiet, checkpoint=checkpoint)
    # measured before it is written: what has no measures leaves no file
    measures = {} if quiet else run_metrics(out.stem, recording)
    recording.save(out)
    for name, value in measures.items():
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
    sensor_range: Annotated[
        float | None, typer.Option("--range", help="Range of the sensor, g; the rig's by default.")
    ] = None,
    resample: Annotated[
        bool, typer.Option("--resample", help="Put samples whose stamps jitter onto even instants.")
    ] = False,
    start: Annotated[float | None, typer.Option("--from", help="First instant to keep, s since the first row.")] = None,
    to: Annotated[float | None, typer.Option("--to", help="Last instant to keep, s since the first row.")] = None,
) -> None:
    """Compare the simulated y acceleration with a sensor's: RMS, SD and main line."""
    from trackdyn.measure.compare import compare_with_sensor
    from trackdyn.sensor.sensor_csv import read_sensor_csv
    from trackdyn.sensor.sensor_mapping import load_mapping
    from trackdyn.simulation.recording import load_recording

    for pair in axis or []:
        if not all(pair.partition("=")):
            raise InputError(f"--axis {pair} is not accepted: an axis and its column, such as ay=channel3, would do")
    axes = dict(pair.split("=", 1) for pair in axis or [])
    chosen = load_mapping(
        mapping,
        time=time,
        rate=rate,
        unit=unit,
        axes=axes,
        range=sensor_range,
        resample=resample,
        to=to,
        **{"from": start},
    )
    loaded = load_recording(recording)
    rig = loaded.meta["rig"]
    record = read_sensor_csv(sensor, chosen, range_g=rig["sensor"]["range"], gravity=rig["gravity"] or 9.81)
    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(loaded, record, str(recording))
    typer.echo("\n" + table.to_string(index=False, float_format=lambda v: f"{v:.4g}", na_rep="-"))
    if "line_hz" not in set(table.measure):
        typer.echo("trackdyn: warning: no line, for which both records must hold two turns of the loop", err=True)


@app.command()
def plan(
    tolerance: Annotated[str, typer.Option(help="What the measure may be off, such as 2% or 0.02.")],
    measure: Annotated[
        str, typer.Option(help="rms, sd, line, left_peak, left_share, right_share or ring_share.")
    ] = "rms",
    rpm: Annotated[str, typer.Option(metavar="NUMBER", help="Motor speed, rev/min.")] = "115",
    ring_radius: Annotated[str, typer.Option(help="Radius of the rubber ring in m, or none.")] = "0.308",
    data: Annotated[Path | None, typer.Option(help="Measured data; results/trade.csv or the short form.")] = None,
) -> None:
    """The cheapest fidelity, step and duration that keep a tolerance, by what was measured."""
    from trackdyn.study.accuracy.planner import LEAD_IN, load_trade
    from trackdyn.study.accuracy.planner import plan as choose

    chosen = choose(load_trade(data), tolerance, measure, _number("--rpm", rpm), _ring(ring_radius))
    for name, value in chosen.fields.items():
        typer.echo(f"{name:>22}  {value}")
    typer.echo(
        f"{'duration':>22}  {chosen.duration:g} s of every link, after {LEAD_IN:g} s at constant "
        f"speed: {chosen.passages} passages"
    )
    typer.echo(
        f"{'expected error':>22}  {chosen.of_setting:.2g} of the setting, {chosen.of_record:.2g} of the record at most"
    )
    typer.echo(f"{'expected cost':>22}  {chosen.cpu_s:.3g} processor seconds on the machine that measured")
    for warning in chosen.warnings:
        typer.echo(f"trackdyn: warning: {warning}; the plan is a guess there", err=True)


@app.command()
def verify(
    results: Annotated[Path, typer.Argument(help="Results of a run, such as results.")],
    against: Annotated[
        Path | None, typer.Option(help="Manifest, or folder, of another run; the manifest in RESULTS by default.")
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Byte for byte, as runs on one kind of machine are.")] = False,
) -> None:
    """Compare the results of a run with a manifest: which figure or table differs, and by how much."""
    from trackdyn.certify.comparison import EQUAL, compare, failed, summary
    from trackdyn.certify.manifest import NAME, describe, load_manifest

    place = results / NAME if against is None else against
    expected = describe(place, whole=True) if place.is_dir() else load_manifest(place)
    findings = compare(describe(results, whole=place.is_dir()), expected)
    for finding in findings:
        if finding.status != EQUAL:
            typer.echo(
                f"{finding.status:>8}  {finding.name}  {finding.shows and f'({finding.shows}) '}{finding.text}".rstrip()
            )
    typer.echo(summary(findings))
    if bad := failed(findings, exact):
        raise InputError(f"{results}: {len(bad)} of {len(findings)} files are not those of {place}")


@app.command()
def crate(
    results: Annotated[Path, typer.Argument(help="Results of a run, with their manifest.json.")],
    out: Annotated[Path | None, typer.Option(help="Zip file to write; crate.zip among the results by default.")] = None,
    recordings: Annotated[
        bool, typer.Option("--recordings", help="With the recordings, which are most of a run.")
    ] = False,
    agent: Annotated[str | None, typer.Option(help="Who ran it, to be named in the crate.")] = None,
) -> None:
    """Pack a run with workflow and inputs into a provenance crate (Workflow Run RO-Crate)."""
    from trackdyn.certify.crate import write_crate

    typer.echo(write_crate(results, out, recordings, agent))


def main() -> None:
    """Entry point: a user's mistake ends in one sentence and exit code 1, an interruption in one line and 130."""
    try:
        if app(standalone_mode=False):  # some versions of typer return an interruption
            raise KeyboardInterrupt
        sys.stdout.flush()
        return
    except (KeyboardInterrupt, typer.Abort):
        from trackdyn.files import broken_off

        sentence, code = f"interrupted; {broken_off()}", 130
    except TrackdynError as error:
        sentence, code = str(error), 1
    except MemoryError:
        sentence, code = "the memory that is free does not suffice; a shorter duration or fewer pitches would do", 1
    except OSError as error:
        if error.filename is None:  # standard output is closed or full: nothing more goes there
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        place = error.filename or "standard output"
        sentence, code = f"{place}: {error.strerror}; give a path that can be written", 1
    except Exception as error:
        if not hasattr(error, "format_message"):  # typer's own, whichever module it stands in
            raise
        words = " ".join(error.format_message().split()).rstrip(".")
        sentence, code = f"{words}; see trackdyn --help", 1
    print(f"trackdyn: {sentence}", file=sys.stderr)
    sys.exit(code)
