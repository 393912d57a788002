"""The command ``trackdyn compare``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options


def compare(
    recording: options.RecordingFile,
    sensor: Annotated[
        Path,
        typer.Argument(
            help="Sensor's file: CSV with columns by name, or MDF, TDMS, LVM, UFF 58, MAT, HDF5, WAV, NPY, Parquet."
        ),
    ],
    mapping: options.Mapping = None,
    time: Annotated[str | None, typer.Option(help="Column of the time stamps, or none (with --rate).")] = None,
    rate: Annotated[float | None, options.number("--rate", "Samples a second, Hz; from the stamps by default.")] = None,
    unit: options.UnitOption = None,
    axis: options.AxisOption = None,
    sensor_range: Annotated[
        float | None, options.number("--range", "Range of the sensor, g; the rig's by default.")
    ] = None,
    scale: Annotated[
        float | None, options.number("--scale", "Counts per g, where the columns hold raw counts.")
    ] = None,
    bits: Annotated[
        int | None, typer.Option(help="Bits of raw counts whose full scale is --range, instead of --scale.")
    ] = None,
    resample: Annotated[
        bool, typer.Option("--resample", help="Put samples whose stamps jitter onto even instants.")
    ] = False,
    gaps: Annotated[
        str | None, typer.Option(help="bridge: interpolate over few lost samples; longest: keep the longest part.")
    ] = None,
    dates: Annotated[str | None, typer.Option(help="day-first or month-first, where both are possible.")] = None,
    start: Annotated[float | None, options.number("--from", "First instant to keep, s since the first row.")] = None,
    to: Annotated[float | None, options.number("--to", "Last instant to keep, s since the first row.")] = None,
    figure: Annotated[
        Path | None, options.file_option("--figure", "Picture to write: two turns of the loop, spectra", ".png", ".svg")
    ] = None,
    out: Annotated[Path | None, options.file_option("--out", "Table to write", ".csv")] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Compare the simulated y acceleration with a sensor's: mean, RMS, SD and dominant peak."""
    axes = options.parse_axes(axis)
    from trackdyn.files import write_csv
    from trackdyn.measure.compare import compare_with_sensor, in_words, other_speed
    from trackdyn.measure.orientation import doubtful_axes
    from trackdyn.sensor.sensor_csv import read_sensor_csv
    from trackdyn.sensor.sensor_mapping import load_mapping
    from trackdyn.simulation.recording import load_recording

    requested = {"time": time, "rate": rate, "unit": unit, "axes": axes, "range": sensor_range, "resample": resample}
    requested |= {"scale": scale, "bits": bits, "gaps": gaps, "dates": dates}
    chosen = load_mapping(mapping, **requested | {"from": start, "to": to})
    for path in filter(None, (figure, out)):
        options.check_output(path, overwrite, recording, sensor, mapping)
    loaded = load_recording(recording)
    rig = loaded.scene.rig
    record = read_sensor_csv(sensor, chosen, range_g=rig.sensor.range, gravity=rig.gravity or 9.81)
    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(loaded, record, str(recording))
    typer.echo("\n" + table.to_string(index=False, float_format=lambda v: f"{v:.4g}", na_rep="-"))
    typer.echo("\n" + in_words(table))
    for doubt in filter(None, (doubtful_axes(loaded, record), other_speed(loaded, record))):
        typer.echo(f"trackdyn: warning: {doubt}", err=True)
    if "line_hz_binfree" not in set(table.measure):
        why = "for which both records must hold two turns of the loop" if loaded.periods.loop_hz else "the loop rests"
        typer.echo(f"trackdyn: warning: no line, {why}", err=True)
    if out is not None:
        write_csv(out, table)
    if figure is not None:
        from trackdyn.plots.spectra import comparison_figure
        from trackdyn.plots.style import save

        label = "synthetic sensor" if record.synthetic else "sensor"
        save(comparison_figure(loaded, record, label), figure, figure.suffix[1:])
