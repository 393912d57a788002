"""The dictionary of columns (``columns.yaml``): type, unit and meaning of those of published CSV files, which a Table
Schema of Frictionless Data has, and words and units of all columns that tables, page and figures show.
"""

import json
import re
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.measure.catalogue import ACCELERATION, CATALOGUE, NAMED, SHARES
from trackdyn.model.arrays import SIDE_WORDS, SIDES

_DICTIONARY = read_yaml(Path(__file__).with_suffix(".yaml"))
UNITS, HEADINGS, WORDS = (_DICTIONARY[name] for name in ("units", "headings", "words"))
SHOWN = (*(measure.column for measure in CATALOGUE if measure.shown), *_DICTIONARY["shown"])  # that a run prints
# columns of metrics.csv: type, unit, description, standard error or why there is none (None of errors themselves)
METRIC_COLUMNS: dict[str, tuple[str, str, str, str | None]] = {k: tuple(v) for k, v in _DICTIONARY["columns"].items()}
for _measure in CATALOGUE:
    if _measure.text:
        _over = "over revolutions of the loop" if _measure in ACCELERATION else "by batch means over passages"
        _column = "number", _measure.unit, _measure.text
        METRIC_COLUMNS[_measure.column] = (*_column, _measure.error)
        if " " not in _measure.error:
            METRIC_COLUMNS.setdefault(_measure.error, (*_column[:2], f"standard error {_over}: {_measure.text}", None))
# published tables: the columns that identify a row, then type, unit and description of every column
TABLES: dict[str, tuple[list[str], dict]] = {"metrics": (["run"], METRIC_COLUMNS)}
TABLES |= {name: (table["key"], table["columns"]) for name, table in _DICTIONARY["tables"].items()}


def _described(name: str, table: str = "metrics") -> tuple:
    if name not in TABLES[table][1]:
        raise InputError(f"{table}: column {name} has no description; give it one in trackdyn/measure/columns.yaml")
    return TABLES[table][1][name]


def error_of(name: str) -> str | None:
    """Column of a column's standard error, or why it has none; None for an error, `InputError` if not described."""
    return _described(name)[3]


def table_schema(columns: Iterable[str], table: str = "metrics") -> dict:
    """Table Schema of a published CSV file: name, type, unit and description of each of its columns, in their order.

    ``table`` is the file's name without ``.csv``, one of ``TABLES``. In ``metrics``, ``standardError`` is the column
    with the standard error, or says why there is none; errors have no such entry. Raises `InputError` for a column that
    is not described.
    """
    fields = []
    for name in columns:
        kind, unit, text, *error = _described(name, table)
        field = {"name": name, "type": kind, "unit": unit, "description": text}
        fields.append(field | ({"standardError": error[0]} if any(error) else {}))
    return {
        "$schema": "https://datapackage.org/profiles/2.0/tableschema.json",
        "fields": fields,
        "missingValues": [""],
        "primaryKey": list(TABLES[table][0]),
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
    if side in SIDES and rest in HEADINGS:
        return f"{SIDE_WORDS[SIDES.index(side)]}, {HEADINGS[rest]}"
    if column in NAMED and NAMED[column].words:
        return NAMED[column].words + (f" ({'% of a turn' if column in SHARES else '%'})" if change else "")
    for ending, unit in UNITS.items():
        before, separator, after = f"_{column}_".partition(f"_{ending}_")
        if separator:
            names = (
                re.sub(rf"(^|_)({'|'.join(UNITS)})(?=_|$)", "", text.strip("_")).strip("_") for text in (before, after)
            )
            return f"{words(', '.join(filter(None, names)))} ({unit})".lstrip()
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Head of a table in two lines: first words that three or more neighbours share (else ""), and how many do."""
    runs = [(first, len(list(run))) for first, run in groupby(column.partition("_")[0] for column in columns)]
    return [group for first, n in runs for group in ([(first, n)] if n > 2 else [("", 1)] * n)]
