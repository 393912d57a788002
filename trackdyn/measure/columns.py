"""Dictionary of columns (``columns.yaml``): type, unit and meaning in published CSV files, headings elsewhere."""

import re
from itertools import groupby
from pathlib import Path

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.measure.catalogue import ACCELERATION, CATALOGUE, NAMED, SHARES
from trackdyn.model.arrays import SIDE_WORDS, SIDES

_DICTIONARY = read_yaml(Path(__file__).with_suffix(".yaml"))
UNITS, HEADINGS, WORDS = (_DICTIONARY[name] for name in ("units", "headings", "words"))
# printed with a run
SHOWN = (*(measure.column.name for measure in CATALOGUE if measure.column.shown), *_DICTIONARY["shown"])
# columns of metrics.csv: type, unit, description, standard error or the reason why there is none (None for errors)
METRIC_COLUMNS: dict[str, tuple[str, str, str, str | None]] = {k: tuple(v) for k, v in _DICTIONARY["columns"].items()}
for _measure in CATALOGUE:
    if (_column := _measure.column).text:
        METRIC_COLUMNS[_column.name] = "number", _column.unit, _column.text, _column.error
        if _column.has_error:
            _over = "over revolutions of the loop" if _measure in ACCELERATION else "by batch means over passages"
            _error = "number", _column.unit, f"standard error {_over}: {_column.text}", None
            METRIC_COLUMNS.setdefault(_column.error, _error)
# published tables: the columns that identify a row, then type, unit and description of every column
TABLES: dict[str, tuple[list[str], dict]] = {"metrics": (["run"], METRIC_COLUMNS)}
TABLES |= {name: (table["key"], table["columns"]) for name, table in _DICTIONARY["tables"].items()}


def described(name: str) -> tuple[str, str, str, str | None]:
    """Return an entry of `METRIC_COLUMNS`; `InputError` if it is missing."""
    if name not in METRIC_COLUMNS:
        raise InputError(f"metrics: column {name} has no description; give it one in trackdyn/measure/columns.yaml")
    return METRIC_COLUMNS[name]


def words(name: str) -> str:
    """Replace names of the program by words: ``ten_arcs`` becomes ``ten arcs``."""
    return WORDS.get(name) or re.sub(r"\w+", lambda match: WORDS.get(match[0], match[0]), name.replace("_", " "))


def heading(column: str, change: bool = False) -> str:
    """Return the heading of a column with its unit in brackets; ``change`` if its values are differences."""
    side, _, rest = column.partition("_")
    if column in HEADINGS:
        return HEADINGS[column]
    if side in SIDES and rest in HEADINGS:
        return f"{SIDE_WORDS[SIDES.index(side)]}, {HEADINGS[rest]}"
    if studied := column in NAMED and NAMED[column].studied:
        return studied.words + (f" ({'% of a turn' if column in SHARES else '%'})" if change else "")
    for ending, unit in UNITS.items():
        before, separator, after = f"_{column}_".partition(f"_{ending}_")
        if separator:
            names = (
                re.sub(rf"(^|_)({'|'.join(UNITS)})(?=_|$)", "", text.strip("_")).strip("_") for text in (before, after)
            )
            return f"{words(', '.join(filter(None, names)))} ({unit})".lstrip()
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Group the columns of a table: first words that three or more neighbours share (else ""), and their counts."""
    runs = [(first, len(list(run))) for first, run in groupby(column.partition("_")[0] for column in columns)]
    return [group for first, n in runs for group in ([(first, n)] if n > 2 else [("", 1)] * n)]
