"""The commands of a recording: ``trackdyn compare`` and ``show``."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from trackdyn.commands import options, printed
from trackdyn.inputs.errors import InputError


@options.with_mapping
def compare(
    recording: options.RecordingFile,
    sensor: Annotated[Path, typer.Argument(help="Sensor's file: a table in text, with columns by name.")],
    mapping: options.Mapping = None,
    name: options.SensorOption = None,
    figure: Annotated[
        Path | None, options.file_option("--figure", "Picture to write: two turns of the loop, spectra", ".png", ".svg")
    ] = None,
    out: Annotated[Path | None, options.file_option("--out", "Table to write", ".csv")] = None,
    overwrite: options.Overwrite = False,
    **fields: Any,
) -> None:
    """Compare the simulated y acceleration with a sensor's: mean, RMS, SD and dominant peak.

    Example: `trackdyn compare run.npz logger.csv --unit g` puts the column ay of a logger's file beside a run.
    """
    import pandas as pd

    from trackdyn.inputs.files import write_text
    from trackdyn.sensor.sensor_csv import read_sensor
    from trackdyn.sensor.sensor_mapping import load_mapping

    chosen = load_mapping(mapping, **options.mapping_fields(**fields))
    mark = options.mark_of("compare", recording, sensor, name or "")
    if figure is not None:
        from trackdyn.plots.style import marked

        options.check_output(figure, overwrite or marked(figure, mark), recording, sensor, mapping)
    if out is not None:  # one that exists is looked at when its table is known
        options.check_output(out, True, recording, sensor, mapping)
    loaded = _load_first(recording, sensor)
    rig = loaded.scene.rig
    if name is not None:
        loaded.sensor_index(name)
    mappings = chosen.of_sensors(rig.sensors, sensor, name)
    if figure is not None and len(mappings) > 1:
        raise InputError(f"--figure {figure}: shows one sensor; name it with --sensor, {', '.join(mappings)}")
    records = {
        name: read_sensor(sensor, own, range_g=loaded.sensors[name].range, gravity=rig.g)
        for name, own in mappings.items()
    }
    tables = {}
    for name, record in records.items():
        if len(rig.sensors) > 1:
            typer.echo(f"sensor {name}")
        tables[name] = _compare(loaded.with_sensor(name), record, str(recording))
    if out is not None:
        table = pd.concat(tables, names=["name"]).reset_index(level=0) if len(tables) > 1 else tables[name]
        text = table.to_csv(index=False, lineterminator="\n")
        options.check_output(out, overwrite or options.holds(out, text))
        write_text(out, text)
    if figure is not None:
        from trackdyn.plots.spectra import comparison_figure
        from trackdyn.plots.style import save

        label = "synthetic sensor" if record.synthetic else "sensor"
        save(comparison_figure(loaded.with_sensor(name), record, label), figure, figure.suffix[1:], mark=mark)


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

    from trackdyn.measure.cells import cell, plain, with_error
    from trackdyn.measure.compare import compare_with_sensor, doubts_of, in_words

    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(recording, record, path)
    rows = []
    for row in table.itertuples():
        simulated = with_error(row.simulation, row.simulation_error)
        compared = cell(row.difference_pct), cell(row.standard_errors)
        rows.append([row.measure, simulated, with_error(row.sensor, row.sensor_error), *compared])
    display = pd.DataFrame(rows, columns=[name for name in table if not name.endswith("_error")])
    typer.echo(f"\n{plain(display.to_string(index=False))}\n\n{in_words(table)}")
    no_line, rests = "", not recording.periods.loop_hz
    if "rms_g" in set(table.measure) and "line_hz_binfree" not in set(table.measure):
        no_line = f"no line, {'the loop rests' if rests else 'for which both records must hold two turns of the loop'}"
    printed.remarks(recording, *map(options.as_options, doubts_of(recording, record, table)), no_line)
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
    """Show a run on one page: the loop moving, tension, sensor, contacts, energy, choices.

    What moves is simulated again from the recording's scene, lead-in included.

    Example: `trackdyn show run.npz` writes run.html, which any browser opens.
    """
    from trackdyn.inputs.files import write_text
    from trackdyn.plots.show import show as make
    from trackdyn.simulation.recording import load_recording

    loaded = load_recording(recording)
    out = recording.with_suffix(".html") if out is None else out
    mark = options.mark_of("show", recording)
    options.check_output(out, overwrite or options.is_sealed(out, mark), recording)
    page = make(loaded, None, seconds, recording.stem, progress=not quiet)
    write_text(out, options.sealed(page.text, mark))
    if not quiet:
        typer.echo(f"{out}: {len(page.text.encode()) / 1e6:.1f} MB, {page.summary}")
