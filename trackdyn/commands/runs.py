"""The commands of one run: ``trackdyn simulate``, ``plan``, ``compare`` and ``show``."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.errors import InputError

FRAMES = 0.05  # s between recorded configurations


def simulate(
    out: Annotated[Path, options.file_argument("Recording to write", ".npz")],
    rig: options.RigName = options.DEFAULT_RIG,
    rpm: options.SpeedOption = 115.0,
    ring_radius: options.RingRadius = None,
    duration: Annotated[float, options.number("--duration", "Recorded time, s.")] = 20.0,
    lead_in: Annotated[float, options.number("--lead-in", "Time at constant speed before the record, s.")] = 5.0,
    preset: Annotated[
        str | None,
        options.preset("Bundle of choices: fast, standard, paper or reference; standard, or what a --tolerance needs."),
    ] = None,
    step: options.StepOption = None,
    choose: options.Choose = None,
    frame_interval: Annotated[
        float | None,
        options.number("--frame-interval", "Time between recorded configurations, s; 0: none; 0.05 by default."),
    ] = None,
    tolerance: options.Tolerance = None,
    measure: options.Measures = None,
    longest: options.LongestRun = 60.0,
    rate: Annotated[
        float | None,
        options.number("--rate", "Samples a second, Hz, such as your sensor's; the rig's by default. The step adapts."),
    ] = None,
    checkpoint: Annotated[
        Path | None, typer.Option(help="File kept while a long run records; the same command goes on from it.")
    ] = None,
    quiet: options.Quiet = False,
) -> None:
    """Run one scene and write its recording; a file of that name is replaced when the run is done.

    With --tolerance the run takes the cheapest method and step that keep it (see `plan`), unless they are stated, and
    ends when every --measure has an error of at most that share, whatever --duration: of its own value, or of a
    sprocket turn for shares.

    Example: `trackdyn simulate run.npz --rpm 150 --duration 12` records 12 s of the default rig at 150 rev/min.
    """
    from tqdm import tqdm

    from trackdyn.jit import announce
    from trackdyn.rig.rig import load_rig
    from trackdyn.scene.scene import Scene

    if measure and tolerance is None:
        raise InputError("--measure needs --tolerance, such as --tolerance 1%")
    if checkpoint is not None and tolerance is not None:
        raise InputError(
            "--checkpoint cannot be combined with --tolerance, whose runs end by themselves; leave one of them out"
        )
    loaded, fields = load_rig(rig), options.scene_fields(ring_radius, step, choose)
    if frame_interval is None:  # whole samples; a run that is shorter records none
        sample = 1.0 / loaded.rate
        frame_interval = max(int(FRAMES / sample + 1e-6), 1) * sample
        frame_interval = frame_interval if duration >= frame_interval else 0.0
    scene = Scene(
        loaded, rpm, duration=duration, lead_in=lead_in, frame_interval=frame_interval, preset=preset, **fields
    )
    if rate is not None:
        scene = scene.sampled(rate)
    if not quiet:
        announce(lambda text: tqdm.write(f"trackdyn: {text}", file=sys.stderr))  # above a bar
    if tolerance is None:
        _for_its_duration(scene, out, checkpoint, rig, quiet)
    else:
        options.check_output(out, True, rig)
        tolerances = dict.fromkeys(measure or ["rms"], tolerance)
        _until_converged(planned(scene, tolerances, longest, preset, fields), tolerances, longest, out, rig, quiet)


def _prepare(scene, out: Path, checkpoint: Path | None, rig: str):
    """Prepare what a run writes; returns the memory and disk that it needs.

    Raises `InputError`: a file cannot be written, or is an input.
    """
    from trackdyn.files import keep
    from trackdyn.simulation.recorder import cost

    needed = cost(scene)
    for path, other in ((out, checkpoint), (checkpoint, out)):
        if path is not None:
            options.check_output(path, True, rig, other, size=needed.file)
    if checkpoint is not None:
        keep(checkpoint)
    if out.exists():
        typer.echo(
            f"trackdyn: warning: {out} exists and is replaced when the run is done; until then Ctrl-C keeps it",
            err=True,
        )
    return needed


def _warn(recording, *sentences: str) -> None:
    """Say some sentences on standard error, and those that belong to the numbers of a run (`remarks`)."""
    from trackdyn.measure.metrics import remarks

    for text in filter(None, (*sentences, *remarks(recording))):
        typer.echo(f"trackdyn: warning: {text}", err=True)


def _say_decisions(scene) -> None:
    """Say the settings that the scene left open, each with its reason, then those that it states, on one line."""
    from trackdyn.scene.choices import ASKED

    for name, decision in scene.fidelity.items():
        if decision.reason != ASKED:
            typer.echo(f"{name:>22}  {decision.setting}: {decision.reason}")
    requested = [f"{name} {choice.setting}" for name, choice in scene.fidelity.items() if choice.reason == ASKED]
    if requested:
        typer.echo(f"{ASKED:>22}  {', '.join(requested)}")
    typer.echo(f"{'step':>22}  {scene.time_step:.7g} s")


def _say_loop(scene, recording, quiet: bool) -> None:
    """The tension at which the loop stands and a step that follows it; a warning where its own ring misses it."""
    from trackdyn.simulation.settling import tension_words

    layout, step = recording.meta["layout"], recording.meta["scene"]["step"]
    if not layout.get("settled_tension_n"):
        return
    words = tension_words(scene, layout)
    if ":" in words and scene.ring_radius == scene.rig.ring_radius:
        typer.echo(f"trackdyn: warning: tension: {words}", err=True)
    if not quiet:
        typer.echo(f"{'tension':>22}  {words}")
        if step != scene.time_step:
            typer.echo(f"{'step':>22}  {step:.7g} s, which this tension needs")


def _for_its_duration(scene, out: Path, checkpoint: Path | None, rig: str, quiet: bool) -> None:
    from trackdyn.simulation.simulate import simulate as run
    from trackdyn.simulation.step_check import BRIEF, again

    needed = _prepare(scene, out, checkpoint, rig)
    if not quiet:
        _say_decisions(scene)
        typer.echo(f"{'needs':>22}  {needed}, more if kernels must be compiled")
        if seconds := again(scene):
            typer.echo(f"{'run again':>22}  {seconds:.3g} s with half the step, to judge it: {BRIEF}")
    recording = run(scene, progress=not quiet, checkpoint=checkpoint)
    if not quiet:
        from trackdyn.measure.cells import plain, with_error
        from trackdyn.measure.metrics import needed_lengths, shown_measures

        measures = shown_measures(recording)  # before it is written: what has no measures leaves no file
    recording.save(out)
    _say_loop(scene, recording, quiet)
    _warn(recording, recording.meta.get("resolved", {}).get("reason", ""))
    if quiet:
        return
    for row in measures:
        number, sensor = plain(with_error(row["value"], row["error"])), row.get("sensor")
        typer.echo(f"{number + ' ' + row['unit']:>22}  {row['measure']}{f' ({sensor})' if sensor else ''}")
    for what, seconds in needed_lengths(recording).items():
        typer.echo(f"{'left out':>22}  {what} need a record of {seconds:.3g} s or more")


def _until_converged(plan, tolerances: dict[str, float], longest: float, out: Path, rig: str, quiet: bool) -> None:
    from trackdyn.measure.cells import plain, with_error
    from trackdyn.measure.sensor import whole_samples
    from trackdyn.measure.uncertainty import unit_of

    scene = plan.scene.with_(duration=whole_samples(plan.scene.rig.rate, plan.duration))
    _prepare(scene, out, None, rig)
    if not quiet:
        say(plan)
        _say_decisions(scene)
    answer = plan.run()
    answer.recording.save(out)
    _say_loop(plan.scene, answer.recording, False)
    _warn(answer.recording)
    for name, estimate in answer.measures.items():
        message = "converged" if answer.reached[name] else "tolerance not reached"
        number = plain(with_error(estimate.value, estimate.half_width))
        typer.echo(f"{name:>22}  {number} {unit_of(name)}  {message}")
    recorded = len(answer.recording.time) / answer.recording.rate
    typer.echo(f"{'left out, recorded (s)':>22}  {answer.transient:.3g}, {recorded:.4g}")
    if not answer.converged:
        raise InputError(
            f"--longest = {longest:g} s is too short for --tolerance {max(tolerances.values()):g}; what was reached is "
            f"written to {out}"
        )


def plan(
    tolerance: options.Tolerance,
    measure: options.Measures = None,
    rig: options.RigName = options.DEFAULT_RIG,
    rpm: options.SpeedOption = 115.0,
    ring_radius: options.RingRadius = None,
    preset: Annotated[str | None, options.preset("Keep the method and step of a preset.")] = None,
    step: options.StepOption = None,
    choose: options.Choose = None,
    longest: options.LongestRun = 60.0,
) -> None:
    """Say what `simulate --tolerance` runs: the cheapest method and step that keep it, from trial runs.

    Example: `trackdyn plan --tolerance 1% --rpm 210` says how an RMS with an error of 1 % is reached, and its cost.
    """
    from trackdyn.rig.rig import load_rig
    from trackdyn.scene.scene import Scene

    fields = options.scene_fields(ring_radius, step, choose)
    scene = Scene(load_rig(rig), motor_rpm=rpm, preset=preset, **fields)
    say(planned(scene, dict.fromkeys(measure or ["rms"], tolerance), longest, preset, fields))


def planned(scene, tolerances: dict[str, float], longest: float, preset: str | None, fields: dict):
    """The plan for a scene; what its options state stays as it is."""
    from trackdyn.measure.planner import plan as choose_setting

    return choose_setting(scene, tolerances, longest, preset is None and not {"step", "integrator"} & fields.keys())


def say(plan) -> None:
    """Say the setting that runs, its expected cost, and the others that were tried."""
    for trial in plan.tried:
        mark = "chosen" if trial is plan.chosen else "tried"
        message = f"rejected: {trial.refused}"
        if not trial.refused:
            errors = ", ".join(f"{name} {error.bias + error.doubt:.2g}" for name, error in trial.error.items())
            message = f"error of {errors}; {trial.cpu_s / trial.seconds:.2g} CPU s a second"
        typer.echo(f"{mark:>22}  {trial.name}: {message}")
    ends = ", ".join(f"{name} to {tolerance:.2g}" for name, tolerance in plan.left.items())
    typer.echo(f"{'stops':>22}  when the 95 % intervals keep {ends}; expected after {plan.duration:.3g} s at speed")
    more = f"{plan.cpu_s:.2g} CPU s more" if plan.cpu_s else "no more: the record is long enough"
    typer.echo(f"{'expected cost':>22}  {plan.trial_cpu_s:.2g} CPU s so far, {more}")


def compare(
    recording: options.RecordingFile,
    sensor: Annotated[
        Path,
        typer.Argument(
            help="Sensor's file: CSV with columns by name, or MDF, TDMS, LVM, UFF 58, MAT, HDF5, WAV, NPY, Parquet."
        ),
    ],
    mapping: options.Mapping = None,
    name: options.SensorOption = None,
    time: options.TimeOption = None,
    rate: options.RateOption = None,
    unit: options.UnitOption = None,
    axis: options.AxisOption = None,
    sensor_range: options.RangeOption = None,
    scale: options.ScaleOption = None,
    zero: options.ZeroOption = None,
    bits: options.BitsOption = None,
    resample: options.ResampleOption = False,
    gaps: options.GapsOption = None,
    dates: options.DatesOption = None,
    start: options.FromOption = None,
    to: options.ToOption = None,
    figure: Annotated[
        Path | None, options.file_option("--figure", "Picture to write: two turns of the loop, spectra", ".png", ".svg")
    ] = None,
    out: Annotated[Path | None, options.file_option("--out", "Table to write", ".csv")] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Compare the simulated y acceleration with a sensor's: mean, RMS, SD and dominant peak.

    Example: `trackdyn compare run.npz logger.csv --unit g` puts the column ay of a logger's file beside a run.
    """
    import pandas as pd

    from trackdyn.files import write_csv
    from trackdyn.sensor.sensor_csv import read_sensor_csv
    from trackdyn.sensor.sensor_mapping import load_mapping

    requested = {"time": time, "rate": rate, "unit": unit, "range": sensor_range, "resample": resample, "scale": scale}
    requested |= {"axes": options.parse_axes(axis), "zero": options.parse_zero(zero), "bits": bits, "gaps": gaps}
    chosen = load_mapping(mapping, **requested | {"dates": dates, "from": start, "to": to})
    for path in filter(None, (figure, out)):
        options.check_output(path, overwrite, recording, sensor, mapping)
    loaded = _load_first(recording, sensor)
    rig = loaded.scene.rig
    if name is not None:
        loaded.sensor_index(name)
    mappings = chosen.of_sensors(rig.sensors, sensor, name)
    if figure is not None and len(mappings) > 1:
        raise InputError(f"--figure {figure}: shows one sensor; name it with --sensor, {', '.join(mappings)}")
    records = {
        name: read_sensor_csv(sensor, own, range_g=loaded.sensors[name].range, gravity=rig.g)
        for name, own in mappings.items()
    }
    tables = {}
    for name, record in records.items():
        if len(rig.sensors) > 1:
            typer.echo(f"sensor {name}")
        tables[name] = _compare(loaded.with_sensor(name), record, str(recording))
    if out is not None:
        table = pd.concat(tables, names=["name"]).reset_index(level=0) if len(tables) > 1 else tables[name]
        write_csv(out, table)
    if figure is not None:
        from trackdyn.plots.spectra import comparison_figure
        from trackdyn.plots.style import save

        label = "synthetic sensor" if record.synthetic else "sensor"
        save(comparison_figure(loaded.with_sensor(name), record, label), figure, figure.suffix[1:])


def _load_first(recording: Path, sensor: Path):
    """Load the recording. Raises `InputError`: it is none, perhaps as the two files are exchanged."""
    from trackdyn.simulation.recording import load_recording

    try:
        return load_recording(recording)
    except InputError as reason:
        refusal = reason
        with suppress(InputError):
            load_recording(sensor)
            refusal = InputError(f"{sensor} is the recording: name it first, then the sensor's file {recording}")
        raise refusal from None


def _compare(recording, record, path: str):
    """Say how a sensor's record was read and how it compares with the simulated one; returns the table."""
    import pandas as pd

    from trackdyn.measure.axes import judge_axes
    from trackdyn.measure.cells import cell, plain, with_error
    from trackdyn.measure.compare import compare_with_sensor, in_words, other_speed
    from trackdyn.measure.uncertainty import whole_errors

    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(recording, record, path)
    whole, rows = whole_errors(recording.scene), []
    for row in table.itertuples():
        simulated = with_error(row.simulation, whole(row.measure, row.simulation, row.simulation_error))
        compared = cell(row.difference_pct), cell(row.standard_errors)
        rows.append([row.measure, simulated, with_error(row.sensor, row.sensor_error), *compared])
    shown = pd.DataFrame(rows, columns=[name for name in table if not name.endswith("_error")])
    typer.echo(f"\n{plain(shown.to_string(index=False))}\n\n{in_words(table)}")
    no_line, rests = "", not recording.periods.loop_hz
    if "rms_g" in set(table.measure) and "line_hz_binfree" not in set(table.measure):
        no_line = f"no line, {'the loop rests' if rests else 'for which both records must hold two turns of the loop'}"
    doubt = judge_axes(recording, record)
    doubts = *record.doubts, doubt.sentence if doubt else "", other_speed(recording, record, table) or "", no_line
    _warn(recording, *doubts)
    return table


def show(
    recording: options.RecordingFile,
    out: Annotated[
        Path | None, options.file_option("--out", "Page to write; the recording's name by default", ".html")
    ] = None,
    seconds: Annotated[
        float | None, options.number("--seconds", "Length of what moves, s; a turn of the sprocket by default.")
    ] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Show a run on one page: the loop moving, tension, sensor, contacts, work, decisions.

    What moves is simulated again from the recording's scene, lead-in included.

    Example: `trackdyn show run.npz` writes run.html, which any browser opens.
    """
    from trackdyn.plots.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    out = recording.with_suffix(".html") if out is None else out
    options.check_output(out, overwrite, recording)
    page = make(loaded, out, seconds, recording.stem, progress=not quiet)
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB, {page.summary}")
