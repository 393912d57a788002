"""Columns of numbers out of the text of a data logger.

Loggers, spreadsheets and apps differ in separators, decimal signs, comments and quotes. A text that can be read in one
way only is read; for any other one sentence says which line is doubtful.
"""

import csv
import io
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, shown
from trackdyn.sensor.stamps import DATE, Rate, seconds_of

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class Source:
    """Columns of a file that have as many rows."""

    path: Path
    names: list[str]
    units: list[str]  # empty texts where the file has none
    dated: frozenset[int] = frozenset()  # columns of dates and times of day: their numbers are in s
    rates: Mapping[int, Rate] = field(default_factory=dict)  # by column, where the file states one
    doubtful: tuple[str, ...] = ()  # numbers, with their names, that may or may not be a rate of samples
    first_line: int = 1  # number of the first row, from 1
    left_out: tuple[str, ...] = ()  # lines of words below the rows
    remarks: Sequence[str] = ()  # warnings of the library that reads the file
    synthetic: bool = False  # whether a comment says that the file is synthetic

    def table(
        self, columns: Sequence[int], time: int | None = None, gaps: bool = False, day_first: bool | None = None
    ) -> np.ndarray:
        """(N, c) numbers of some columns.

        Dates and times in the column ``time`` are s since the first row (`stamps.seconds_of`). With ``gaps`` what is no
        finite number in other columns is NaN: empty fields, words, marks of an overload. Raises `InputError`: the first
        defect.
        """
        return self._numbers(columns, time, gaps, day_first)

    def _numbers(self, columns, time, gaps, day_first) -> np.ndarray:
        raise NotImplementedError

    def rises(self, column: int) -> bool:
        """Whether a column may hold stamps: dates, words, or numbers that rise and never fall."""
        if column in self.dated:
            return True
        try:
            values = self.table([column], gaps=True)
        except InputError:
            return True  # a form that is not read, such as 1,000
        values = values[np.isfinite(values)]
        return values.size < 2 or bool((np.diff(values) >= 0).all() and np.ptp(values) > 0)


@dataclass(frozen=True, kw_only=True)
class Text(Source):
    """Rows of a text."""

    separator: str  # between the fields
    body: str  # the rows, without what ends the file

    def _numbers(self, columns, time, gaps, day_first) -> np.ndarray:
        if time in self.dated:
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


def rows_of(path: Path, text: str, names: list[str], units: list[str], separator: str, first: int) -> Text:
    """Rows of a text from line ``first`` (from 0) on, without blank and comment lines and words at its end."""
    above = text.split("\n", first)[:first]
    position = sum(map(len, above)) + first
    body, below = text[position:].rstrip(" \n\x1a"), []
    while body:
        line = body[(cut := body.rfind("\n") + 1) :].strip()
        comment = line.startswith("#")
        words = re.search(r"[^\W\d_]{2}", line) and not any(map(is_value, split_fields(line, separator)))
        if not (comment or words):
            break
        below += [] if comment else [line]
        body = body[:cut].rstrip(" \n\x1a")
    fields = enumerate(split_fields(body.partition("\n")[0], separator))
    dated = frozenset(k for k, field in fields if DATE.fullmatch(field) and not NUMBER.fullmatch(field))
    comments = "".join(line for line in above if line.lstrip().startswith("#"))
    return Text(
        path=path, names=names, units=units, dated=dated, first_line=first + 1, left_out=tuple(below[::-1]),
        synthetic="synthetic" in comments.casefold(), separator=separator, body=body,
    )  # fmt: skip


def _decimal_sign(text: Text, columns: Sequence[int]) -> str:
    head = (split_fields(line, text.separator) for line in text.body.split("\n", 100)[:100])
    commas = [field for fields in head for k, field in enumerate(fields) if k in columns and "," in field]
    if commas and all(map(_GROUPED.fullmatch, commas)):
        raise InputError(
            f"{text.path}: the comma in {shown(commas[0])} may mark decimals or thousands; save the "
            "file with decimal points."
        )
    return "," if commas else "."


def _parse_fast(text: Text, columns: list[int], decimal: str, time: int | None, gaps: bool) -> np.ndarray | None:
    """The numbers of a clean body; None for whatever needs a closer look."""
    body, separator, width = text.body, text.separator, len(text.names)
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


def _parse_by_line(text: Text, columns: Sequence[int], decimal: str, time: int | None, gaps: bool) -> np.ndarray:
    """The numbers line by line, or the sentence for the first defect."""
    path, names, separator = text.path, text.names, text.separator
    lines = text.body.split("\n") if text.body else []
    table = np.empty((len(lines), len(columns)))
    for k, line in enumerate(lines):
        number = text.first_line + k
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
