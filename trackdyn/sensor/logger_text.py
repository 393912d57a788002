"""The text of a data logger's CSV file to columns of numbers.

Loggers, spreadsheets and apps differ in separators, decimal signs, comments, quotes and what stands above the header.
What can be read in one way only is read; for anything else one sentence says what is doubtful.
"""

import csv
import io
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, shown
from trackdyn.sensor.sensor_mapping import NAME_IT
from trackdyn.sensor.stamps import DATE, Rate, never_falls, seconds_of

_HEAD = 200  # lines in which the header is looked for
_LONGEST = 20_000  # characters of such a line
_SECTION = re.compile(r"\[[^\[\]]*\]")  # title of a part of a file
_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)


class Layout(NamedTuple):
    """Where the columns and rows of a text stand; read as `logger_files.Channels` are."""

    path: Path  # the file
    # names, units: of the columns: the header, and a row of units below it or empty texts
    names: list[str]
    units: list[str]
    separator: str  # between the fields
    first_line: int  # line of the first row of numbers, from 1
    body: str  # the rows, without what ends the file
    left_out: tuple[str, ...] = ()  # lines of text below the rows
    # as those of channels: a text states no rate, no library reads it
    rates: Mapping[int, Rate] = {}
    doubtful: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def first(self, column: int) -> str:
        """The field of a column in the first row; empty if there is none."""
        fields = split_fields(self.body.partition("\n")[0], self.separator, len(self.names))
        return fields[column] if len(fields) > column else ""

    def is_dated(self, column: int) -> bool:
        """Whether the first row has a date or a time of day in a column."""
        first = self.first(column)
        return bool(DATE.fullmatch(first) and not NUMBER.fullmatch(first))

    def rises(self, column: int) -> bool:
        """Whether the values of a column may be stamps."""
        if self.is_dated(column):
            return True
        try:
            return never_falls(self.table([column]))
        except InputError:
            return True  # a form that is not read yet

    def table(
        self, columns: Sequence[int], time: int | None = None, gaps: bool = False, day_first: bool | None = None
    ) -> np.ndarray:
        """(N, c) numbers of some columns.

        The column ``time`` may hold dates and times: these are s since the first row (`stamps.seconds_of`). With
        ``gaps`` what is no finite number in other columns is NaN: empty fields, words, marks of an overload. Raises
        `InputError`: the first defect.
        """
        if time is not None and self.is_dated(time):
            rest = self.table([column for column in columns if column != time], gaps=gaps)
            split = split_fields if '"' in self.body or self.separator == " " else str.split
            texts = [split(line, self.separator)[time].strip(" \t'") for line in self.body.split("\n")]
            seconds = seconds_of(self.path, self.names[time], texts, self.first_line, day_first)
            return np.insert(rest, columns.index(time), seconds, axis=1)
        decimal = _decimal_sign(self, columns)
        table = _parse_fast(self, list(columns), decimal, time, gaps)
        return _parse_by_line(self, columns, decimal, time, gaps) if table is None else table


def split_fields(line: str, separator: str, count: int = 0) -> list[str]:
    """Fields of a line without quotes and blanks around them; empty ones at the end beyond ``count`` are dropped."""
    try:
        fields = [
            f.strip(" \t'") for f in next(csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True), [])
        ]
    except csv.Error:
        fields = [line]
    while len(fields) > count and not fields[-1]:
        fields.pop()
    return fields


def _is_value(field: str) -> bool:
    """Whether a field is a number or a date and time: data, not a name."""
    return bool(NUMBER.fullmatch(field.replace(",", ".", 1)) or _NOT_FINITE.fullmatch(field) or DATE.fullmatch(field))


def _separators(line: str) -> list[str]:
    return [separator for separator in _SEPARATORS if separator in line] or [" "]


def _of_values(line: str) -> str | None:
    """The separator with which a line holds values only; None if there is none."""
    for separator in _separators(line):
        if (fields := split_fields(line, separator)) and all(map(_is_value, fields)):
            return separator
    return None


def find_layout(
    path: Path,
    text: str,
    recognised: Callable[[Sequence[str]], bool],
    sought: str,
    numbers: Sequence[int] = (),
    is_unit: Callable[[str], bool] = bool,
) -> Layout:
    """Find header and rows.

    The header is the first line, perhaps behind a ``#``, whose names are ``recognised`` and are as many as the fields
    of the row that follows. If all columns are chosen by position (``numbers``, from 0), the rows are located by the
    values in these columns, and the header, if there is one, is the line above; else columns are named "1", "2" and so
    on. ``sought`` says in a refusal which column is missing, ``is_unit`` tells a row of units from one of names. Raises
    `InputError`: no line is such a header, or no line is such a row.
    """
    head = text.split("\n", _HEAD)[:_HEAD]
    if long := next((i + 1 for i, line in enumerate(head) if len(line) > _LONGEST), 0):
        raise InputError(
            f"{path}: line {long} has {len(head[long - 1])} characters, at most {_LONGEST} are read; export the "
            "columns of the sensor alone, a sample a line."
        )
    rows = [
        i
        for i, line in enumerate(head)
        if line.strip() and not line.lstrip().startswith("#") and not _SECTION.fullmatch(line.strip())
    ]
    if not rows:
        what = "holds comments only" if text.strip() else "is empty"
        raise InputError(f"{path}: the file {what}; it must hold a header such as 't_s,ax_g,ay_g,az_g', and rows.")
    if numbers:
        names, units, separator, first = _layout_by_position(path, head, rows, numbers, is_unit)
        return Layout(path, names, units, separator, first + 1, *_body(text, first, separator))
    unequal = None
    for i, line in enumerate(head):
        line = line.strip(" ")
        commented = line.startswith("#")
        line = line.lstrip("#").strip() if commented else line
        for separator in _separators(line):
            names, below = split_fields(line, separator), [j for j in rows if j > i]
            if commented and below and len(names) == len(split_fields(head[below[0]], separator)) + 1:
                names = names[1:]  # a label of the line, such as Headers
            if not recognised(names):
                continue
            units = [""] * len(names)
            if len(below) > 1:
                row = split_fields(head[below[0]], separator)
                if len(row) == len(names) and not any(map(_is_value, row)):
                    units = row
                    del below[0]
            if not below or len(split_fields(head[below[0]], separator, len(names))) == len(names):
                for j in rows[: rows.index(below[0]) if below else None]:
                    fields = split_fields(head[j], separator, len(names))
                    if len(fields) == len(names) and all(map(_is_value, fields)):
                        raise InputError(
                            f"{path}: line {j + 1} holds numbers ({shown(head[j])}) above the names in line {i + 1}; "
                            "remove it, or write the names above it."
                        )
                first = below[0] if below else len(head)
                return Layout(path, names, units, separator, first + 1, *_body(text, first, separator))
            if i in rows:
                unequal = unequal or (i, names, separator, below[0])
    if unequal:
        i, names, separator, first = unequal
        _refuse_fields(path, head[first], first + 1, names, separator, f"the header in line {i + 1}")
    _refuse_header(path, head, rows, sought)


def _refuse_header(path: Path, head: Sequence[str], rows: Sequence[int], sought: str) -> NoReturn:
    """Say that no line is a header, and show the line that looks most like it: above the first row of numbers."""
    first = next((k for k, j in enumerate(rows) if _of_values(head[j])), 1)
    if first == 0:
        raise InputError(
            f"{path}: line {rows[0] + 1} holds numbers ({shown(head[rows[0]])}) where the names of the columns must "
            "be; write them above, or give all columns by number, such as --time 1 --axis ay=3 --unit g."
        )
    separator = (_of_values(head[rows[first]]) if first < len(rows) else None) or _separators(head[rows[first - 1]])[0]
    names = split_fields(head[rows[first - 1]], separator)
    raise InputError(f"{path}: no {sought} in line {rows[first - 1] + 1} ({listed(names)}); {NAME_IT}.")


def _layout_by_position(path, head, rows, numbers, is_unit) -> tuple[list[str], list[str], str, int]:
    """Names, units, separator and first row (from 0) of a file whose columns are chosen by position."""
    for at, line in enumerate(rows):
        for separator in _separators(head[line]):
            if layout := _rows_from(path, head, rows, at, separator, numbers, is_unit):
                return layout
    for i in rows:
        of_values = _of_values(head[i])
        if of_values and (width := len(split_fields(head[i], of_values))) <= max(numbers):
            raise InputError(
                f"{path}: no column {max(numbers) + 1}; line {i + 1} ({shown(head[i])}) has {width} fields."
            )
    wanted = " and ".join(str(k + 1) for k in sorted(numbers))
    raise InputError(
        f"{path}: no rows with numbers in column {wanted} within {len(head)} lines; give another column, or, if only "
        "the stamps are neither numbers nor dates as 2024-05-01T12:00:00.001, --time none --rate HZ."
    )


def _rows_from(path, head, rows, at, separator, numbers, is_unit) -> tuple[list[str], list[str], str, int] | None:
    """See `_layout_by_position`; None if the rows do not begin at ``rows[at]`` with this separator.

    They begin with the first one that has values in these columns, as the next two have, and the same number of
    fields. A line with text where the rows below have values is a header or a preamble.
    """
    count, first = max(len(split_fields(head[i], separator)) for i in rows[at : at + 3]), rows[at]

    def fields(i):
        return split_fields(head[i].strip(" ").lstrip("#").strip(" "), separator, count)

    def chosen(i):
        return len(fields(i)) == count > max(numbers) and all(_is_value(fields(i)[k]) for k in numbers)

    def mostly_values(texts):
        return 2 * sum(map(_is_value, texts)) > sum(map(bool, texts))

    def text_above_values(i):
        below = [fields(i) for i in rows[at + 1 : at + 11] if len(fields(i)) == count]
        return any(
            field and not _is_value(field) and mostly_values([row[k] or "empty" for row in below])
            for k, field in enumerate(fields(i))
        )

    if not all(map(chosen, rows[at : at + 3])) or text_above_values(first):
        return None
    above = [i for i in range(first) if head[i].strip(" #")][-2:][::-1]
    named = list(takewhile(lambda i: len(fields(i)) == count and _names(fields(i), numbers), above))
    header = named[: 1 + (len(named) > 1 and any(map(is_unit, fields(named[0]))))]
    # a row above is a row, too: what follows it is a defect
    earlier = [i for i in rows[:at] if i not in header and (chosen(i) or mostly_values(fields(i)))]
    earlier = [i for i in earlier if len(fields(i)) == count]
    if earlier and not mostly_values(fields(earlier[0])) and text_above_values(earlier[0]):
        raise InputError(
            f"{path}: line {earlier[0] + 1} ({shown(head[earlier[0]])}) holds text where line {first + 1} holds "
            "numbers; correct it if it is a row, else remove it."
        )
    if earlier:
        first, header = earlier[0], []
    elif not header and _are_indices(fields(first), [fields(i) for i in rows[at + 1 : at + 2]]):
        raise InputError(
            f"{path}: line {first + 1} ({shown(head[first])}) may hold the numbers of the columns or values; remove it."
        )
    if not header:
        return [str(k + 1) for k in range(count)], [""] * count, separator, first
    return fields(header[-1]), fields(header[0]) if len(header) > 1 else [""] * count, separator, first


def _names(fields: Sequence[str], numbers: Sequence[int]) -> bool:
    """Whether fields are names, at least in the columns ``numbers``; names may be numbers that count the columns."""
    texts = [field for field in fields if field and not _is_value(field)]
    return bool(texts or not fields[0]) and (not any(_is_value(fields[k]) for k in numbers) or _are_indices(fields))


def _are_indices(fields: Sequence[str], below: Sequence[Sequence[str]] = ()) -> bool:
    """Whether the values among fields count the columns, from 0 or 1, and not also the rows ``below``."""
    values = [field for field in fields if _is_value(field)]
    counted = len(values) > 1 - bool(set(fields) - set(values)) and any(
        values == [str(k + start) for k in range(len(values))] for start in (0, 1)
    )
    return counted and not (below and fields[0] and below[0][0] == str(int(values[0]) + 1))


def _body(text: str, first: int, separator: str) -> tuple[str, tuple[str, ...]]:
    """Text from line ``first`` (from 0) on, and lines of words below it.

    Blank and comment lines and old editors' marks at its end are left out.
    """
    position = 0
    for _ in range(first):
        position = text.find("\n", position) + 1 or len(text)
    body, below = text[position:].rstrip(" \n\x1a"), []
    while body:
        line = body[(cut := body.rfind("\n") + 1) :].strip()
        comment = line.startswith("#")
        words = re.search(r"[^\W\d_]{2}", line) and not any(map(_is_value, split_fields(line, separator)))
        if not (comment or words):
            break
        below += [] if comment else [line]
        body = body[:cut].rstrip(" \n\x1a")
    return body, tuple(below[::-1])


def _decimal_sign(layout: Layout, columns: Sequence[int]) -> str:
    head = (split_fields(line, layout.separator) for line in layout.body.split("\n", 100)[:100])
    commas = [field for fields in head for k, field in enumerate(fields) if k in columns and "," in field]
    if commas and all(map(_GROUPED.fullmatch, commas)):
        raise InputError(
            f"{layout.path}: the comma in {shown(commas[0])} may mark decimals or thousands; save the "
            "file with decimal points."
        )
    return "," if commas else "."


def _parse_fast(layout: Layout, columns: list[int], decimal: str, time: int | None, gaps: bool) -> np.ndarray | None:
    """The numbers of a clean body; None for whatever needs a closer look."""
    body, separator, width = layout.body, layout.separator, len(layout.names)
    if body.partition("\n")[0].endswith(separator):
        body = re.sub(rf"{re.escape(separator)}+$", "", body, flags=re.MULTILINE)
    rows = body.count("\n") + 1
    # told which columns to use, pandas drops what a row has too much; where separators cannot be counted it reads all
    some = None if separator == " " or '"' in body else sorted(set(columns))
    if some and body.count(separator) != rows * (width - 1):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # fields would be lost
            table = pd.read_csv(
                io.BytesIO(body.encode()),
                header=None,
                names=range(width),
                usecols=some,
                sep=r"\s+" if separator == " " else separator,
                dtype=dict.fromkeys(columns, np.float64),
                decimal=decimal,
                skipinitialspace=True,
                index_col=False,
            )[columns].to_numpy()
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning):
        return None
    may_miss = [gaps and column != time for column in columns]
    whole = np.isfinite(table) | np.array(may_miss)
    return np.where(whole & ~np.isfinite(table), np.nan, table) if len(table) == rows and whole.all() else None


def _parse_by_line(layout: Layout, columns: Sequence[int], decimal: str, time: int | None, gaps: bool) -> np.ndarray:
    """The numbers line by line, or the sentence for the first defect."""
    path, names, separator = layout.path, layout.names, layout.separator
    lines = layout.body.split("\n") if layout.body else []
    table = np.empty((len(lines), len(columns)))
    for k, line in enumerate(lines):
        number = layout.first_line + k
        fields = split_fields(line, separator, len(names))
        if len(fields) != len(names):
            _refuse_fields(path, line, number, names, separator, "the file")
        for column, index in enumerate(columns):
            plain = fields[index].replace(".", "?").replace(",", ".") if decimal == "," else fields[index]
            value = float(plain) if NUMBER.fullmatch(plain) else np.nan
            table[k, column] = value if np.isfinite(value) else np.nan
            if np.isfinite(value) or (gaps and index != time):
                continue
            wanted = f"a finite number with a decimal {'comma' if decimal == ',' else 'point'}"
            remedy = "give --gaps bridge or --gaps longest"
            if index == time:
                wanted += " or a date and time as 2024-05-01T12:00:00.001"
                remedy = "read no stamps, --time none --rate HZ"
            raise InputError(
                f"{path}: field {names[index]} in line {number} is {shown(fields[index])}, not {wanted}; correct it, "
                f"remove the line, or {remedy}."
            )
    return table


def _refuse_fields(path, line, number, names, separator, what) -> NoReturn:
    """Say that a row has not as many fields as the header has names."""
    where = f"{path}: line {number} ({shown(line)})"
    if not line.strip() or line.lstrip().startswith("#"):
        raise InputError(f"{where} is {'a comment' if line.strip() else 'empty'} among the rows; remove the line.")
    raise InputError(
        f"{where} has {len(split_fields(line, separator, len(names)))} fields between {_SEPARATORS[separator]} and "
        f"{what} has {len(names)} names ({listed(names)}); complete or remove it, use one separator everywhere and no "
        "decimal commas among commas, or give all columns by number, such as --time 1 --axis ay=3."
    )


def listed(names: Sequence[str]) -> str:
    """Names of columns as they may stand in a sentence."""
    return ", ".join(map(shown, names[:8])) + (", ..." if len(names) > 8 else "")
