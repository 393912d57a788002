"""Columns of numbers out of the text of a data logger.

Loggers, spreadsheets and apps differ in separators, decimal signs, comments and quotes. A text that can be read in one
way only is read; for any other one sentence says which line is doubtful.
"""

import csv
import io
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, shown
from trackdyn.sensor.stamps import DATE, Rate, never_falls, seconds_of

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
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


def is_value(field: str) -> bool:
    """Whether a field is a number or a date and time: data, not a name."""
    return bool(NUMBER.fullmatch(field.replace(",", ".", 1)) or _NOT_FINITE.fullmatch(field) or DATE.fullmatch(field))


def body(text: str, first: int, separator: str) -> tuple[str, tuple[str, ...]]:
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
        words = re.search(r"[^\W\d_]{2}", line) and not any(map(is_value, split_fields(line, separator)))
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
            refuse_fields(path, line, number, names, separator, "the file")
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


def refuse_fields(path, line, number, names, separator, what) -> NoReturn:
    """Say that a row has not as many fields as the header has names."""
    where = f"{path}: line {number} ({shown(line)})"
    if not line.strip() or line.lstrip().startswith("#"):
        raise InputError(f"{where} is {'a comment' if line.strip() else 'empty'} among the rows; remove the line.")
    raise InputError(
        f"{where} has {len(split_fields(line, separator, len(names)))} fields between {SEPARATORS[separator]} and "
        f"{what} has {len(names)} names ({listed(names)}); complete or remove it, use one separator everywhere and no "
        "decimal commas among commas, or give all columns by number, such as --time 1 --axis ay=3."
    )


def listed(names: Sequence[str]) -> str:
    """Names of columns as they may stand in a sentence."""
    return ", ".join(map(shown, names[:8])) + (", ..." if len(names) > 8 else "")
