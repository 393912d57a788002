"""Columns of numbers out of the text of a data logger.

Loggers, spreadsheets and apps differ in separators, decimal signs, comments and quotes. A text that can be read in one
way only is read; for any other one sentence says which line is doubtful.
"""

import csv
import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

import numpy as np
import pandas as pd

from fieldtest.sensor_mapping import in_cell
from fieldtest.stamps import DATE, seconds_of
from trackdyn.inputs.errors import InputError, shown

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
NUMBER = re.compile(r"([+-] ?)?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_GROUPED = {sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}([{sign}]\d{{3}})+", re.ASCII) for sign in ",."}
# by their decimal sign, numbers whose other sign stands between thousands: -1.451,5 and -1,451.5
_WITH_THOUSANDS = {",": re.compile(rf"{_GROUPED['.'].pattern},\d+"), ".": re.compile(rf"{_GROUPED[','].pattern}\.\d+")}
_APART = re.compile(r"(?<=\d)['\u2019 \u2009](?=\d{3}(?!\d))")  # signs that stand between thousands alone


@dataclass(frozen=True, kw_only=True)
class Source:
    """Columns of a file or of a table that have as many rows."""

    path: Path
    names: list[str]
    units: list[str]  # empty texts where there is none
    dated: frozenset[int] = frozenset()  # columns of dates and times of day: their numbers are in s
    lines: Sequence[int]  # number of each row, in a text of its line, from 1
    left_out: tuple[str, ...] = ()  # lines of words below the rows
    synthetic: bool = False  # whether a comment says that the file is synthetic

    def texts(self, column: int) -> list[str]:
        """The N cells of a column as they are written."""
        raise NotImplementedError

    def columns(self) -> list[Sequence[str]]:
        """The cells of every column as they are written."""
        return [self.texts(column) for column in range(len(self.names))]

    def numbers(self, columns: Sequence[int], time: int | None = None, day_first: bool | None = None) -> np.ndarray:
        """(N, c) numbers of some columns, NaN where a cell holds none.

        Dates and times in the column ``time`` are s since the first row (`stamps.seconds_of`).
        """
        raise NotImplementedError

    def refuse(self, row: int, column: int, time: bool, decimal: str = ".") -> NoReturn:
        """Refuse (`InputError`) a cell that holds no number, nor a ``time``."""
        unit = in_cell(self.texts(column)[0])[1]
        wanted = f"a finite number with a decimal {'comma' if decimal == ',' else 'point'}{f' in {unit}' * bool(unit)}"
        wanted += " or a date and time as 2024-05-01T12:00:00.001" * time
        remedy = "read no stamps, `time: none, rate: HZ`" if time else "give `gaps: bridge` or `gaps: longest`"
        raise InputError(
            f"{self.path}: field {self.names[column]} in {self.where(row)} is {shown(self.texts(column)[row])}, not "
            f"{wanted}; correct it, remove the row, or {remedy}."
        )

    def where(self, row: int) -> str:
        """Where a row stands, in words."""
        return f"line {self.lines[row]}"

    def misfits(self) -> np.ndarray:
        """(N,) whether a row has another number of fields than there are columns, so that it is no sample."""
        return np.zeros(len(self.lines), bool)

    def only(self, chosen: np.ndarray) -> "Source":
        """Some of the rows."""
        raise NotImplementedError

    def rises(self, column: int) -> bool:
        """Whether a column may hold stamps: dates, words, or numbers that rise and never fall."""
        values = self.stamps(column)
        return values.size < 2 or bool((np.diff(values) >= 0).all() and np.ptp(values) > 0)

    def stamps(self, column: int) -> np.ndarray:
        """The numbers of a column that may be the time; none if it has a form that is not read, such as 1,000."""
        try:
            values = self.numbers([column], column, True)[:, 0]
        except InputError:
            return np.empty(0)
        return values[np.isfinite(values)]


@dataclass(frozen=True, kw_only=True)
class Table(Source):
    """Columns of a DataFrame; of a column of objects the texts are read."""

    frame: pd.DataFrame

    def texts(self, column: int) -> list[str]:
        """The cells of a column as texts."""
        return ["" if missing else str(cell).strip() for cell, missing in self._cells(column)]

    def _cells(self, column: int):
        cells = self.frame.iloc[:, column]
        return zip(cells, cells.isna(), strict=True)

    def numbers(self, columns: Sequence[int], time: int | None = None, day_first: bool | None = None) -> np.ndarray:
        """(N, c) numbers; see `Source`."""
        return np.column_stack([self._numbers(column, column == time, day_first) for column in columns])

    def _numbers(self, column: int, time: bool, day_first: bool | None) -> np.ndarray:
        cells = self.frame.iloc[:, column]
        if cells.dtype.kind in "mM":
            return np.asarray((cells - cells.min()).dt.total_seconds(), dtype=float)
        if pd.api.types.is_numeric_dtype(cells) and not (pd.api.types.is_bool_dtype(cells) or cells.dtype.kind == "c"):
            values = cells.to_numpy(float, na_value=np.nan)
            return np.where(np.isfinite(values), values, np.nan)
        if time and column in self.dated:
            return seconds_of(self.path, self.names[column], self.texts(column), day_first)
        return _numbers(self.texts(column), ".")

    def where(self, row: int) -> str:
        """Where a row stands, in words."""
        return f"row {self.lines[row]}"

    def only(self, chosen: np.ndarray) -> "Table":
        """Some of the rows."""
        return replace(self, frame=self.frame[chosen], lines=np.asarray(self.lines)[chosen])


def table_of(frame: pd.DataFrame) -> Table:
    """Columns of a DataFrame, and its index where that is named or of times; names of several levels are joined."""
    index = frame.index
    numbered = index.name is None and index.dtype.kind not in "mMf"  # rows that are counted, perhaps sorted
    if not (numbered or isinstance(index, pd.MultiIndex)):
        # an index of samples is no column by this name
        frame = frame.reset_index(names=[index.name or "time"])
    if frame.columns.empty:
        raise InputError("the table: it has no columns; give one with time and ay.")
    names = ["/".join(map(str, name)) if isinstance(name, tuple) else str(name) for name in frame.columns]
    source = Table(path=Path("the table"), names=names, units=[""] * len(names), lines=range(len(frame)), frame=frame)
    texts = [k for k, (_, column) in enumerate(frame.items()) if column.dtype.kind not in "iufbcmM"]
    first = {k: next(filter(None, source.texts(k)), "") for k in texts}
    dated = {k for k, (_, column) in enumerate(frame.items()) if column.dtype.kind in "mM"}
    dated |= {k for k in texts if _is_stamp(first[k])}
    units = [in_cell(first.get(k, ""))[1] for k in range(len(names))]
    return replace(source, units=units, dated=frozenset(dated))


@dataclass(frozen=True, kw_only=True)
class Text(Source):
    """Rows of a text."""

    separator: str  # between the fields
    body: str  # the rows, without what ends the file

    def texts(self, column: int) -> list[str]:
        """The cells of a column without quotes and blanks around them."""
        return [fields[column] if len(fields) > column else "" for fields in self._fields()]

    def columns(self) -> list[Sequence[str]]:
        """The cells of every column."""
        count = len(self.names)
        return list(zip(*((fields + [""] * count)[:count] for fields in self._fields()), strict=True))

    def _fields(self) -> list[list[str]]:
        lines = self.body.split("\n") if self.body else []
        return [split_fields(line, self.separator, len(self.names)) for line in lines]

    def numbers(self, columns: Sequence[int], time: int | None = None, day_first: bool | None = None) -> np.ndarray:
        """(N, c) numbers; see `Source`. A row with another number of fields than the header has names holds none."""
        columns = list(columns)
        if time in self.dated:
            at = columns.index(time)
            texts = [fields[time] if len(fields) == len(self.names) else "" for fields in self._fields()]
            seconds = seconds_of(self.path, self.names[time], texts, day_first)
            rest = [column for column in columns if column != time]
            table = np.insert(self.numbers(rest), at, seconds, axis=1) if rest else seconds[:, None]
            return np.where(np.isnan(seconds)[:, None], np.nan, table)
        decimal = _decimal_sign(self, columns)
        clean = _parse_fast(self, columns, decimal)
        if clean is not None:
            table = clean
        else:
            rows = [fields if len(fields) == len(self.names) else [""] * len(self.names) for fields in self._fields()]
            table = np.column_stack([_numbers([fields[column] for fields in rows], decimal) for column in columns])
        for column, values in zip(columns, table.T, strict=True):
            _require_decimals(self, column, values, decimal)
        return table

    def misfits(self) -> np.ndarray:
        """(N,) whether a row has another number of fields; see `Source`."""
        return np.array([len(fields) != len(self.names) for fields in self._fields()], bool)

    def refuse(self, row: int, column: int, time: bool, decimal: str = ".") -> NoReturn:
        """Refuse (`InputError`) a row or a cell; see `Source`."""
        line = self.body.split("\n")[row]
        if len(split_fields(line, self.separator, len(self.names))) != len(self.names):
            refuse_fields(self.path, line, self.lines[row], self.names, self.separator, "the file")
        if re.fullmatch(r"[+-]?\d{1,3}(,\d\d,\d{3}|(\.\d{3})+|(,\d{3})+)", cell := self.texts(column)[row], re.ASCII):
            _refuse_thousands(self.path, cell)
        super().refuse(row, column, time, _decimal_sign(self, [column]))

    def only(self, chosen: np.ndarray) -> "Text":
        """Some of the rows."""
        lines = self.body.split("\n") if self.body else []
        body = "\n".join(line for line, take in zip(lines, chosen, strict=True) if take)
        return replace(self, body=body, lines=np.asarray(self.lines)[chosen])


def split_fields(line: str, separator: str, count: int = 0) -> list[str]:
    """Fields of a line without quotes and blanks around them; empty ones at the end beyond ``count`` are dropped."""
    if '"' not in line and separator != " ":
        fields = [field.strip(" \t'") for field in line.split(separator)]
    else:
        try:
            parsed = csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True)
            fields = [field.strip(" \t'") for field in next(parsed, [])]
        except csv.Error:
            fields = [line]
    while len(fields) > count and not fields[-1]:
        fields.pop()
    return fields


def is_value(field: str) -> bool:
    """Whether a field is a number, perhaps with its unit, or a date and time: data, not a name."""
    if DATE.fullmatch(field) or _NOT_FINITE.fullmatch(field):
        return True
    return bool(NUMBER.fullmatch(_plain(in_cell(field)[0]).replace(",", ".", 1)))


def is_words(line: str, separator: str) -> bool:
    """Whether a line that is no row holds words, or is a rule such as -----, and no value."""
    letters = re.search(r"[^\W\d_]{2}", line) or re.fullmatch(r"[-=+*_| ]+", line)
    return bool(letters) and not any(map(is_value, split_fields(line, separator)))


def _plain(number: str) -> str:
    """A number without signs between its thousands, where a decimal sign tells them apart."""
    if len(number) > 4 and re.match(rf"[+-]?\d{{1,3}}{_APART.pattern}", number):
        number = _APART.sub("", number)
    for decimal, thousands in (",.", ".,"):
        if _WITH_THOUSANDS[decimal].fullmatch(number):
            return number.replace(thousands, "")
    return number


def _is_stamp(field: str) -> bool:
    return bool(DATE.fullmatch(field) and not NUMBER.fullmatch(field))


def _numbers(cells: Sequence[str], decimal: str) -> np.ndarray:
    """Numbers in the cells of a column; NaN where there is none, or one of another unit than others have."""
    parted = [in_cell(cell) for cell in cells]
    unit = next((unit for _, unit in parted if unit), "")
    return np.array([_number(text, decimal) if own in ("", unit) else np.nan for text, own in parted], float)


def _number(text: str, decimal: str) -> float:
    """The number in a text, whose blank behind the sign does not count; NaN if it is none."""
    plain = _plain(text)
    plain = plain.replace(".", "?").replace(",", ".") if decimal == "," else plain
    value = float(plain.replace(" ", "")) if NUMBER.fullmatch(plain) else np.nan
    return value if np.isfinite(value) else np.nan


def rows_of(path: Path, text: str, names: list[str], units: list[str], separator: str, first: int) -> Text:
    """Rows of a text from line ``first`` (from 0) on, without blank lines, and without comments and words at its end.

    A column without a unit has that of its first cell.
    """
    above = text.split("\n", first)[:first]
    position = sum(map(len, above)) + first
    body, below = text[position:].rstrip(" \n\x1a"), []
    while body:
        line = body[(cut := body.rfind("\n") + 1) :].strip()
        comment = line.startswith("#") or not line.strip(separator)
        if not comment and not is_words(line, separator):
            break
        below += [] if comment else [line]
        body = body[:cut].rstrip(" \n\x1a")
    lines: Sequence[int] = range(first + 1, first + 1 + body.count("\n") + bool(body))
    if re.search(r"\n[ \t]*\n", body):
        written = [(number, line) for number, line in zip(lines, body.split("\n"), strict=True) if line.strip()]
        lines, body = [number for number, _ in written], "\n".join(line for _, line in written)
    fields = split_fields(body.partition("\n")[0], separator, len(names))
    dated = frozenset(k for k, field in enumerate(fields) if _is_stamp(field))
    if len(fields) == len(units):
        units = [unit or in_cell(field)[1] for unit, field in zip(units, fields, strict=True)]
    comments = "".join(line for line in above if line.lstrip().startswith("#"))
    return Text(
        path=path, names=names, units=units, dated=dated, lines=lines, left_out=tuple(below[::-1]),
        synthetic="synthetic" in comments.casefold(), separator=separator, body=body,
    )  # fmt: skip


def _decimal_sign(text: Text, columns: Sequence[int]) -> str:
    head = (split_fields(line, text.separator) for line in text.body.split("\n", 100)[:100])
    fields = [in_cell(field)[0] for fields in head for k, field in enumerate(fields) if k in columns]
    commas = [field for field in fields if "," in field and not _WITH_THOUSANDS["."].fullmatch(field)]
    if commas and all(map(_GROUPED[","].fullmatch, commas)):
        _refuse_thousands(text.path, commas[0])
    return "," if commas else "."


def _require_decimals(text: Text, column: int, values: np.ndarray, decimal: str) -> None:
    """Refuse (`InputError`) points that may group thousands: 500 and 1.234, but no number between 0 and 1."""
    if decimal == ",":
        return
    broken = values[np.isfinite(values) & (values != np.round(values))]
    if broken.size and np.abs(broken).min() > 1 and np.abs(broken).max() < 1000:
        if np.abs(1000 * broken - np.round(1000 * broken)).max() > 1e-6 * np.abs(broken).max():
            return
        cells = [cell for cell in text.texts(column) if cell]
        points = [cell for cell in cells if "." in cell]
        if len(points) < len(cells) and all(map(_GROUPED["."].fullmatch, points)):
            _refuse_thousands(text.path, points[0])


def _refuse_thousands(path: Path, cell: str) -> NoReturn:
    raise InputError(
        f"{path}: the {'comma' if ',' in cell else 'point'} in {shown(cell)} may mark decimals or thousands; save the "
        "file with decimal points and without signs between thousands."
    )


def _parse_fast(text: Text, columns: list[int], decimal: str) -> np.ndarray | None:
    """The numbers of a clean body; None for whatever needs a closer look."""
    body, separator, width = text.body, text.separator, len(text.names)
    if body.partition("\n")[0].endswith(separator):
        body = re.sub(rf"{re.escape(separator)}+$", "", body, flags=re.MULTILINE)
    rows = len(text.lines)
    # told which columns to use, pandas drops what a row has too much; where separators cannot be counted it reads all
    some = None if separator == " " or '"' in body else sorted(set(columns))
    if not body or (some and body.count(separator) != rows * (width - 1)):
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
    return np.where(np.isfinite(table), table, np.nan) if len(table) == rows else None


def refuse_fields(path, line, number, names, separator, what) -> NoReturn:
    """Say that a row has not as many fields as the header has names."""
    where = f"{path}: line {number} ({shown(line)})"
    if line.lstrip().startswith("#"):
        raise InputError(f"{where} is a comment among the rows; remove the line.")
    fields = split_fields(line, separator, len(names))
    between = f"{where} has {len(fields)} fields between {SEPARATORS[separator]} and {what} has {len(names)} names"
    whole = len(fields) > len(names) and all(re.fullmatch(r"-?\d+", field) for field in fields)
    if separator == "," and (are_split(fields) or whole):
        raise InputError(
            f"{between} ({listed(names)}): decimal commas among commas{', or names are missing' * whole}; save it with "
            f"decimal points, or with semicolons or tabs between the columns{', or complete the names' * whole}."
        )
    raise InputError(
        f"{between} ({listed(names)}); complete or remove it, use one separator everywhere, give all columns by "
        "number, such as `time: 1, axes: {ay: 3}`, or, if some rows are no samples, `gaps: longest`."
    )


def are_split(fields: Sequence[str]) -> bool:
    """Whether fields between commas look like numbers that a decimal comma has split: -0 and 5064."""
    return any(
        re.fullmatch(r"-?\d+", whole) and re.fullmatch(r"\d+", rest)
        and (whole == "-0" or (rest.startswith("0") and len(rest) > 1))
        for whole, rest in pairwise(fields)
    )  # fmt: skip


def listed(names: Sequence[str]) -> str:
    """Names of columns as they may stand in a sentence."""
    return ", ".join(map(shown, names[:8])) + (", ..." if len(names) > 8 else "")
