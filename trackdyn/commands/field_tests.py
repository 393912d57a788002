"""The command ``trackdyn compare``, whose options are the fields of a sensor's mapping."""

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from keyword import iskeyword
from pathlib import Path
from typing import Annotated, Any

import typer

from trackdyn.commands import console, options
from trackdyn.commands.own_files import noting
from trackdyn.inputs.errors import InputError

_SENSOR = "Sensor's file: a table in text, with columns by name."
_MAPPING = "YAML file with the options of the sensor's file."
_NAME = "Sensor of this record, where the rig has several."
_FIGURE = "Picture to write: two turns of the loop, spectra"


def parse_axes(pairs: list[str] | None) -> dict[str, str]:
    """Parse columns by axis. Raises `InputError`: a pair is not ``axis=column``."""
    for pair in pairs or []:
        if not all(pair.partition("=")):
            raise InputError(f"--axis {pair}: expected an axis and its column, such as ay=channel3")
    return dict(pair.split("=", 1) for pair in pairs or [])


def parse_zero(texts: list[str] | None) -> float | dict[str, float] | None:
    """Parse the value of the file at 0 g: ``512``, or by axis, ``ay=512``. Raises `InputError`: it is no number."""
    accepted = "must be a number, or one of an axis, such as 512 or ay=512"
    pairs = [text.rpartition("=") for text in texts or []]
    numbers = {axis: options.parse_number("--zero", value, accepted) for axis, _, value in pairs}
    if not numbers.keys() <= {"ax", "ay", "az"} and (len(pairs) > 1 or "" not in numbers):
        raise InputError(f"--zero {' '.join(texts or [])}: {accepted}")
    return numbers.get("", numbers) or None


def of_mapping() -> dict[str, Parameter]:
    """Return options for the fields of a sensor's mapping except ``sensors``, by the names of the fields."""
    from trackdyn.fieldtest.sensor_mapping import SensorMapping

    mapped = {}
    for field, schema in SensorMapping.model_json_schema()["$defs"]["SensorMapping"]["properties"].items():
        name, help = options.option_of(field), schema.get("description", "")
        kinds = {kind.get("type") for kind in (schema, *schema.get("anyOf", ()))}
        if "boolean" in kinds:
            option: Any = Annotated[bool, typer.Option(name, help=help)]
        elif "object" in kinds:
            metavar = "[AXIS=]NUMBER" if "number" in kinds else "AXIS=COLUMN"
            option = Annotated[list[str] | None, options.repeatable(name, metavar, help)]
        elif "number" in kinds and "string" not in kinds:
            option = Annotated[float | None, options.number(name, help)]
        else:
            plain, metavar = (int, "COUNT") if "integer" in kinds else (str, "ANGLE" if "number" in kinds else "TEXT")
            option = Annotated[plain | None, typer.Option(name, metavar=metavar, help=help)]
        named, default = f"{field}_" if iskeyword(field) else field, False if "boolean" in kinds else None
        mapped[field] = Parameter(named, Parameter.KEYWORD_ONLY, default=default, annotation=option)
    del mapped["sensors"]
    return mapped


def with_mapping(command: Callable) -> Callable:
    """Add the fields of a sensor's mapping to the arguments of a command when it is called or its help is printed."""
    parameters = [p for p in signature(command).parameters.values() if p.kind is not p.VAR_KEYWORD]

    def complete() -> Callable:
        def stated(**arguments: Any) -> None:
            command(**arguments)

        complete_parameters = [*parameters, *of_mapping().values()]
        stated.__signature__ = Signature(complete_parameters)  # type: ignore[attr-defined]
        stated.__annotations__ = {parameter.name: parameter.annotation for parameter in complete_parameters}
        return stated

    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.complete = complete  # type: ignore[attr-defined]
    return command


@with_mapping
def compare(
    recording: options.RecordingFile,
    sensor: Annotated[Path, typer.Argument(metavar="SENSOR", help=_SENSOR)],
    mapping: Annotated[Path | None, typer.Option("--mapping", metavar="FILE", help=_MAPPING)] = None,
    name: Annotated[str | None, typer.Option("--sensor", metavar="NAME", help=_NAME)] = None,
    figure: Annotated[Path | None, options.file_option("--figure", _FIGURE, ".png", ".svg")] = None,
    out: Annotated[Path | None, options.file_option("--out", "Table to write", ".csv")] = None,
    overwrite: options.Overwrite = False,
    **fields: Any,
) -> None:
    """Compare the simulated y acceleration with a sensor's.

    Compared are mean, RMS, SD and dominant peak.

    Example: `trackdyn compare run.npz logger.csv --unit g` compares the column ay of a logger's file with a run.
    """
    import pandas as pd

    from trackdyn.fieldtest.sensor_csv import read_sensor
    from trackdyn.fieldtest.sensor_mapping import load_mapping
    from trackdyn.inputs.files import write_csv
    from trackdyn.simulation.recording import load_recording

    stated = {field.removesuffix("_"): value for field, value in fields.items()}
    stated |= {"axes": parse_axes(stated["axes"]), "zero": parse_zero(stated["zero"])}
    chosen = load_mapping(mapping, **stated)
    for path in filter(None, (figure, out)):
        options.check_output(path, overwrite, recording, sensor, mapping)
    loaded = load_recording(recording)
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
    with noting([recording, sensor, mapping], *filter(None, (figure, out))):
        if out is not None:
            table = pd.concat(tables, names=["name"]).reset_index(level=0) if len(tables) > 1 else tables[name]
            write_csv(out, table)
        if figure is not None:
            from trackdyn.fieldtest.figures import comparison_figure
            from trackdyn.plots.style import save

            label = "synthetic sensor" if record.synthetic else "sensor"
            save(comparison_figure(loaded.with_sensor(name), record, label), figure, figure.suffix[1:])


def _compare(recording, record, path: str):
    """Print how a sensor's record was read and its comparison with the simulated one; return the table."""
    import pandas as pd

    from trackdyn.fieldtest.compare import compare_with_sensor, doubts_of, in_words
    from trackdyn.measure.columns import STANDARD_ERROR, cell, plain, with_error

    for name, text in record.done.items():
        typer.echo(f"{name:>10}  {text}")
    table = compare_with_sensor(recording, record, path)
    rows = []
    for row in table.itertuples():
        simulated = with_error(row.simulation, row.simulation_error)
        compared = cell(row.difference_pct), cell(row.standard_errors), cell(row.clear_from, 2)
        rows.append([row.measure, simulated, with_error(row.sensor, row.sensor_error), *compared])
    display = pd.DataFrame(rows, columns=[name for name in table if not name.endswith("_error")])
    typer.echo(f"\n{plain(display.to_string(index=False))}\n+-: {STANDARD_ERROR}\n\n{in_words(table)}")
    no_line, rests = "", not recording.periods.loop_hz
    if "rms_g" in set(table.measure) and "line_hz_binfree" not in set(table.measure):
        no_line = f"no line, {'the loop rests' if rests else 'for which both records must hold two turns of the loop'}"
    console.remarks(recording, *map(options.as_options, doubts_of(recording, record, table)), no_line)
    return table
