"""Columns of tables (``columns.yaml``): type, unit and meaning in published CSV files, headings and cells elsewhere."""

import re
from collections.abc import Sequence
from itertools import groupby
from math import floor, log10
from pathlib import Path

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.measure.catalogue import ACCELERATION, CATALOGUE, NAMED, SHARES
from trackdyn.measure.uncertainty import ROUNDING
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
# errors behind a +-, in every output
HALF_WIDTH = "half of the 95 % interval, with the error of the step"
STANDARD_ERROR = "standard error (68 %), with the error of the step"


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
    units = rf"(^|_)({'|'.join(UNITS)})(?=_|$)"
    for ending, unit in UNITS.items():
        before, separator, after = f"_{column}_".partition(f"_{ending}_")
        if separator:
            names = (re.sub(units, "", text.strip("_")).strip("_") for text in (before, after))
            return f"{words(', '.join(filter(None, names)))} ({unit})".lstrip()
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Group the columns of a table: first words that three or more neighbours share (else ""), and their counts."""
    runs = [(first, len(list(run))) for first, run in groupby(column.partition("_")[0] for column in columns)]
    return [group for first, n in runs for group in ([(first, n)] if n > 2 else [("", 1)] * n)]


def significant(value, digits: int = 3) -> str:
    """Format a cell with significant digits, trailing zeros included, and an exponent for very small and large numbers.

    Numbers that need fewer digits have no more, whole numbers keep theirs, text is unchanged, None is a dash.
    """
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if value is None or value != value or value == "":
        return "–"
    if not isinstance(value, float) or not np.isfinite(value):
        return str(value)
    if value and not 1e-4 <= abs(value) < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    short = f"{value:.{digits}g}"
    return short if float(short) == value else f"{value:#.{digits}g}".rstrip(".")


def cell(value, digits: int = 3) -> str:
    """Format a cell (`significant`) with a proper minus."""
    text = significant(value, digits)
    return text.replace("-", "\N{MINUS SIGN}") if isinstance(value, float) else text


def plain(text: str) -> str:
    """Replace the characters of a cell that a terminal may lack."""
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{PLUS-MINUS SIGN}", "+-").replace("\N{EN DASH}", "-")


def with_error(value: float | None, error: float | None) -> str:
    """Format a value to the decimals of its error, which has two digits, up to eight: 44.2511 ± 0.0013."""
    if value is None or error is None or not error > ROUNDING * abs(value):
        return cell(value)
    decimals = min(8, max(0, 1 - floor(log10(error))))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def listed(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``150, 180 and 210``."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
