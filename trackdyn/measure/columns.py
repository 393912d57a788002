"""The dictionary of columns (``columns.yaml``): type, unit and meaning of those of published CSV files, which a Table
Schema of Frictionless Data has, and words and units of all columns that tables, page and figures show.
"""

import json
import re
from collections.abc import Iterable
from pathlib import Path

from trackdyn.errors import InputError
from trackdyn.parameters.yaml_file import read_yaml

_DICTIONARY = read_yaml(Path(__file__).with_suffix(".yaml"))
REVOLUTIONS, PASSAGES = "over revolutions of the loop", "by batch means over passages"
PLACES = {"left": "the left arc", "right": "the right arc", "ring": "a link on the ring"}
# columns of metrics.csv: type, unit, description, standard error or why there is none (None of errors themselves)
COLUMNS: dict[str, tuple[str, str, str, str | None]] = {name: tuple(of) for name, of in _DICTIONARY["columns"].items()}
COLUMNS |= {
    error: ("number", unit, f"standard error {REVOLUTIONS}: {text}", None)
    for _, unit, text, error in COLUMNS.values()
    if error and " " not in error and error not in COLUMNS
}
# the same of a side, without type
SIDE_COLUMNS: dict[str, tuple[str, str, str | None]] = {
    name: tuple(of) for name, of in _DICTIONARY["side_columns"].items()
}
SIDE_COLUMNS |= {
    error: (unit, f"standard error {PASSAGES}: {text}", None)
    for unit, text, error in SIDE_COLUMNS.values()
    if error and " " not in error
}
# other published tables: the columns that identify a row, then type, unit and description of every column
TABLES: dict[str, tuple[list[str], dict[str, list[str]]]] = {
    name: (of["key"], of["columns"]) for name, of in _DICTIONARY["tables"].items()
}
UNITS, MEASURES, HEADINGS, WORDS = (_DICTIONARY[name] for name in ("units", "measures", "headings", "words"))


def error_of(name: str) -> str | None:
    """Column of a column's standard error, or why it has none; None for an error, `InputError` if not described."""
    side, _, rest = name.partition("_")
    if name in COLUMNS:
        return COLUMNS[name][3]
    if side in PLACES and rest in SIDE_COLUMNS:
        error = SIDE_COLUMNS[rest][2]
        return f"{side}_{error}" if error in SIDE_COLUMNS else error
    if side in PLACES and rest == "areas":
        return "what was visited at all, no number"
    raise InputError(f"metrics: column {name} has no description; give it one in trackdyn/measure/columns.yaml")


def _field(name: str) -> dict:
    side, _, rest = name.partition("_")
    error = error_of(name)
    if name in COLUMNS:
        kind, unit, text = COLUMNS[name][:3]
    elif rest in SIDE_COLUMNS:
        kind, (unit, text) = "number", SIDE_COLUMNS[rest][:2]
    else:
        kind, unit, text = "string", "", "areas of the groove that {} visits, such as 2,3, or none"
    field = {"name": name, "type": kind, "unit": unit, "description": text.format(PLACES.get(side))}
    return field if error is None else field | {"standardError": error}


def table_schema(columns: Iterable[str], table: str = "metrics") -> dict:
    """Table Schema of a published CSV file: name, type, unit and description of each of its columns, in their order.

    ``table`` is the file's name without ``.csv``: ``metrics``, or one of ``TABLES``. In ``metrics``, ``standardError``
    is the column with the standard error, or says why there is none; errors have no such entry. Raises `InputError` for
    a column that is not described here.
    """
    key, described = TABLES.get(table, (("run",), {}))
    fields = []
    for name in columns:
        if table == "metrics":
            fields.append(_field(name))
        elif name in described:
            fields.append(dict(zip(("name", "type", "unit", "description"), (name, *described[name]), strict=True)))
        else:
            raise InputError(f"{table}: column {name} has no description; give it one in trackdyn/measure/columns.yaml")
    return {
        "$schema": "https://datapackage.org/profiles/2.0/tableschema.json",
        "fields": fields,
        "missingValues": [""],
        "primaryKey": list(key),
    }


def schema_text(columns: Iterable[str], table: str = "metrics") -> str:
    """`table_schema` as the JSON text that is written beside the file."""
    return json.dumps(table_schema(columns, table), indent=1, ensure_ascii=False) + "\n"


def words(name: str) -> str:
    """A name of the program in words: ``ten_arcs`` becomes ``ten arcs``."""
    return WORDS.get(name) or re.sub(r"\w+", lambda match: WORDS.get(match[0], match[0]), name.replace("_", " "))


def heading(column: str, change: bool = False) -> str:
    """Name of a column in words with its unit in brackets; ``change`` if measures of it are differences."""
    side, _, rest = column.partition("_")
    if column in HEADINGS:
        return HEADINGS[column]
    if side in PLACES and rest in HEADINGS:
        return f"{side}{' arc' * (side != 'ring')}, {HEADINGS[rest]}"
    if column in MEASURES:
        unit = "% of a turn" if column.endswith("share") else "%"
        return MEASURES[column][0] + (f" ({unit})" if change else "")
    for ending, unit in UNITS.items():
        before, separator, after = f"_{column}_".partition(f"_{ending}_")
        if separator:
            parts = (
                re.sub(rf"(^|_)({'|'.join(UNITS)})(?=_|$)", "", text.strip("_")).strip("_") for text in (before, after)
            )
            return f"{words(', '.join(filter(None, parts)))} ({unit})".lstrip()
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Head of a table in two lines: first words that three or more neighbours share (else ""), and how many do."""
    runs: list[tuple[str, int]] = []
    for column in columns:
        first = column.partition("_")[0]
        if runs and runs[-1][0] == first:
            runs[-1] = (first, runs[-1][1] + 1)
        else:
            runs.append((first, 1))
    return [group for first, n in runs for group in ([(first, n)] if n > 2 else [("", 1)] * n)]
