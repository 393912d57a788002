"""Columns of numbers from the text of a data logger, with its separators, signs and quotes, or a table of pandas."""

import csv
import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress, pairwise
from typing import NoReturn

import numpy as np
import pandas as pd

from trackdyn.fieldtest.sensor_mapping import Column, columns_of, in_cell
from trackdyn.fieldtest.stamps import DATE, NO_STAMPS, is_index, seconds_of
from trackdyn.inputs.errors import InputError, shown

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
_THOUSANDS = "'\u2019 \u2009"  # signs that only separate thousands
_GROUPED = {sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}([{sign}]\d{{3}})+", re.ASCII) for sign in ",."}
# numbers by their decimal sign: plain ones, and those with the other sign, or with signs of their own, among thousands
NUMBER = {
    decimal: re.compile(
        rf"{_GROUPED[other].pattern}[{decimal}]\d+|((?:[+-] ?)?(\d+([{decimal}]\d*)?|[{decimal}]\d+)"
        rf"|[+-]?\d{{1,3}}([{_THOUSANDS}]\d{{3}})+([{decimal}]\d*)?)([eE][+-]?\d+)?",
        re.ASCII,
    )
    for decimal, other in (".,", ",.")
}
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Source:
    """Rows of a text or of a table of pandas, N, and their c columns."""

    columns: list[Column]
    body: str | pd.DataFrame  # the rows, without the end of the file; columns of objects are read as text
    lines: Sequence[int]  # number of each row, in a text of its line, from 1
    separator: str = ""  # between the fields of a text
    dated: frozenset[int] = frozenset()  # columns of dates and times of day: their numbers are in s
    group: str = ""  # columns and codes of the rows that were chosen, node=2,kind=ACC
    left_out: tuple[str, ...] = ()  # lines of words below the rows
    synthetic: bool = False  # True if a comment states that the file is synthetic

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]

    @property
    def rows(self) -> list[str]:
        """Lines of a text; empty for a table."""
        return self.body.split("\n") if isinstance(self.body, str) and self.body else []

    @cached_property
    def cells(self) -> list[list[str]]:
        """Cells of each row as written, without quotes and blanks around them."""
        if isinstance(self.body, str):
            return [split_fields(line, self.separator, len(self.columns)) for line in self.rows]
        texts = [
            ["" if missing else str(cell).strip() for cell, missing in zip(cells, cells.isna(), strict=True)]
            for _, cells in self.body.items()
        ]
        return list(map(list, zip(*texts, strict=True)))

    def texts(self, column: int) -> list[str]:
        """Return the N cells of a column."""
        return [row[column] if len(row) > column else "" for row in self.cells]

    def numbers(self, columns: Sequence[int], time: int | None = None) -> np.ndarray:
        """Return (N, c) numbers of columns, or `InputError`; NaN for other cells and rows of another number of fields.

        Dates and times in the column ``time`` are s since the first row (`stamps.seconds_of`).
        """
        text = isinstance(self.body, str)
        values = {} if text else _typed(self.body, columns)

        def whole_rows(column: int) -> list[str]:
            return [row[column] if len(row) == len(self.columns) else "" for row in self.cells]

        if time is not None and time in self.dated and time not in values:
            values[time] = seconds_of(whole_rows(time))
        if rest := [column for column in columns if column not in values]:
            decimal = self._decimal_sign(rest)
            clean = self._parsed_at_once(rest, decimal) if text else None
            parsed = [_numbers(whole_rows(column), decimal) for column in rest] if clean is None else clean.T
            values |= zip(rest, parsed, strict=True)
            for column in rest if text and decimal == "." else ():
                self._require_decimals(column, values[column])
        return np.column_stack([values[column] for column in columns])

    def _decimal_sign(self, columns: Sequence[int]) -> str:
        """Return the decimal sign of a text. Raises `InputError`: it may also separate thousands."""
        lines = self.body.split("\n", 100)[:100] if isinstance(self.body, str) else []
        head = [split_fields(line, self.separator) for line in lines]
        fields = [in_cell(field)[0] for row in head for k, field in enumerate(row) if k in columns]
        commas = [field for field in fields if "," in field and not NUMBER["."].fullmatch(field)]
        if commas and all(map(_GROUPED[","].fullmatch, commas)):
            _refuse_thousands(commas[0])
        return "," if commas else "."

    def _require_decimals(self, column: int, values: np.ndarray) -> None:
        """Refuse (`InputError`) points that may separate thousands: 500 and 1.234, but no number between 0 and 1."""
        broken = values[np.isfinite(values) & (values != np.round(values))]
        if not broken.size or np.abs(broken).min() <= 1 or np.abs(broken).max() >= 1000:
            return
        if np.abs(1000 * broken - np.round(1000 * broken)).max() <= 1e-6 * np.abs(broken).max():
            cells = [cell for cell in self.texts(column) if cell]
            points = [cell for cell in cells if "." in cell]
            if len(points) < len(cells) and all(map(_GROUPED["."].fullmatch, points)):
                _refuse_thousands(points[0])

    def _parsed_at_once(self, columns: Sequence[int], decimal: str) -> np.ndarray | None:
        """Return (N, c) numbers of a clean body; None if it needs a closer look."""
        body, separator, width, rows = str(self.body), self.separator, len(self.columns), len(self.lines)
        if body.partition("\n")[0].endswith(separator):
            body = re.sub(rf"{re.escape(separator)}+$", "", body, flags=re.MULTILINE)
        # with usecols pandas drops the extra fields of a row; where separators cannot be counted it reads all columns
        some = None if separator == " " or '"' in body else sorted(set(columns))
        if not body or (some and body.count(separator) != rows * (width - 1)):
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", pd.errors.ParserWarning)  # fields would be lost
                table = pd.read_csv(
                    io.BytesIO(body.encode()), header=None, names=range(width), usecols=some, decimal=decimal,
                    sep=r"\s+" if separator == " " else separator, dtype=dict.fromkeys(columns, np.float64),
                    skipinitialspace=True, index_col=False,
                )[columns].to_numpy()  # fmt: skip
        except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning):
            return None
        return np.where(np.isfinite(table), table, np.nan) if len(table) == rows else None

    def refuse(self, row: int, column: int, time: bool) -> NoReturn:
        """Refuse (`InputError`) a row of another number of fields, or a cell without a number or, if ``time``, date."""
        if self.rows and len(self.cells[row]) != len(self.columns):
            refuse_fields(self.rows[row], self.lines[row], self.names, self.separator, "the file")
        texts = self.texts(column)
        if re.fullmatch(r"[+-]?\d{1,3}(,\d\d,\d{3}|(\.\d{3})+|(,\d{3})+)", texts[row], re.ASCII):
            _refuse_thousands(texts[row])
        unit, sign = in_cell(texts[0])[1], "comma" if self._decimal_sign([column]) == "," else "point"
        wanted = f"a finite number with a decimal {sign}{f' in {unit}' * bool(unit)}"
        wanted += " or a date and time as 2024-05-01T12:00:00.001" * time
        remedy = f"read no stamps, {NO_STAMPS}" if time else "give `gaps: bridge` or `gaps: longest`"
        field = f"field {self.columns[column].name} in {self.where(row)} is {shown(texts[row])}"
        raise InputError(f"{field}, not {wanted}; correct it, remove the row, or {remedy}.")

    def where(self, row: int) -> str:
        """Return the line of a text, or the row of a table, for a message."""
        return f"{'line' if isinstance(self.body, str) else 'row'} {self.lines[row]}"

    def only(self, chosen: np.ndarray) -> "Source":
        """Return the rows of a mask."""
        body = "\n".join(compress(self.rows, chosen)) if isinstance(self.body, str) else self.body[chosen]
        return replace(self, body=body, lines=np.asarray(self.lines)[chosen])

    def stamps(self, column: int) -> np.ndarray:
        """Return the numbers of a column that may be the time; none if their form is ambiguous, such as 1,000."""
        try:
            values = self.numbers([column], column)[:, 0]
        except InputError:
            return np.empty(0)
        return values[np.isfinite(values)]


def _typed(frame: pd.DataFrame, columns: Sequence[int]) -> dict[int, np.ndarray]:
    """Return (N,) numbers of those columns of a table that are numbers or times, in s since the first."""
    values = {}
    for column in columns:
        cells = frame.iloc[:, column]
        if cells.dtype.kind in "mM":
            values[column] = np.asarray((cells - cells.min()).dt.total_seconds(), dtype=float)
        elif pd.api.types.is_numeric_dtype(cells) and cells.dtype.kind not in "bc" and cells.dtype != "boolean":
            numbers = cells.to_numpy(float, na_value=np.nan)
            values[column] = np.where(np.isfinite(numbers), numbers, np.nan)
    return values


def table_of(frame: pd.DataFrame) -> Source:
    """Return the columns of a DataFrame, and its index if that has a name or times; level names are joined by ``/``."""
    index, kind = frame.index, frame.index.dtype.kind
    # row numbers, perhaps sorted
    numbered = index.name is None and (kind not in "mMf" or (kind == "f" and is_index(index.to_numpy())))
    again = index.name in frame and np.array_equal(frame[index.name].to_numpy().ravel(), index.to_numpy())
    if not (numbered or again or isinstance(index, pd.MultiIndex)):
        # an index of samples is no column by this name
        frame = frame.reset_index(names=[index.name or "time"], allow_duplicates=True)
    if frame.columns.empty:
        raise InputError("it has no columns; give one with time and ay.")
    names = ["/".join(map(str, name)) if isinstance(name, tuple) else str(name) for name in frame.columns]
    source = Source(columns=columns_of(names), lines=range(len(frame)), body=frame)
    kinds = [dtype.kind for dtype in frame.dtypes]
    first = {k: next(filter(None, source.texts(k)), "") for k, kind in enumerate(kinds) if kind not in "iufbcmM"}
    dated = {k for k, kind in enumerate(kinds) if kind in "mM" or (k in first and _is_stamp(first[k]))}
    units = [in_cell(first.get(k, ""))[1] for k in range(len(names))]
    return replace(source, columns=columns_of(names, units), dated=frozenset(dated))


def split_fields(line: str, separator: str, count: int = 0) -> list[str]:
    """Split a line into fields without quotes and blanks around them; drop empty ones at the end beyond ``count``."""
    fields = line.split(separator)
    if '"' in line or separator == " ":
        try:
            fields = next(csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:
            fields = [line]
    fields = [field.strip(" \t'") for field in fields]
    while len(fields) > count and not fields[-1]:
        fields.pop()
    return fields


def is_value(field: str) -> bool:
    """Return whether a field is a number, perhaps with its unit, or a date and time, rather than a name."""
    text = in_cell(field)[0]
    return any(form.fullmatch(text) for form in (DATE, _NOT_FINITE, *NUMBER.values()))


def is_words(line: str, separator: str) -> bool:
    """Return whether a line has words or is a rule such as -----, and has no value."""
    letters = re.search(r"[^\W\d_]{2}", line) or re.fullmatch(r"[-=+*_| ]+", line)
    return bool(letters) and not any(map(is_value, split_fields(line, separator)))


def _is_stamp(field: str) -> bool:
    return bool(DATE.fullmatch(field) and not NUMBER["."].fullmatch(field))


def _numbers(cells: Sequence[str], decimal: str) -> np.ndarray:
    """Return (N,) numbers of the cells of a column; NaN for other cells, or another unit than the first."""
    parted = [in_cell(cell) for cell in cells]
    unit = next((unit for _, unit in parted if unit), "")
    return np.array([number_in(text, decimal) if own in ("", unit) else np.nan for text, own in parted], float)


def number_in(text: str, decimal: str = ".") -> float:
    """Return the number in a text, without blanks and signs between thousands; NaN for any other text."""
    if not NUMBER[decimal].fullmatch(text):
        return np.nan
    value = float(re.sub(rf"[^\d{decimal}eE+-]", "", text).replace(",", "."))
    return value if np.isfinite(value) else np.nan


def rows_of(text: str, names: list[str], units: list[str], first: int, separator: str) -> Source:
    """Return the rows of a text from line ``first`` (from 0) on, without blank lines, and comments and words below."""
    above = text.split("\n", first)[:first]
    body, below = text[sum(map(len, above)) + first :].rstrip(" \n\x1a"), []
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
    if len(fields) == len(units):
        units = [unit or in_cell(field)[1] for unit, field in zip(units, fields, strict=True)]
    return Source(
        columns=columns_of(names, units), body=body, lines=lines, separator=separator, left_out=tuple(below[::-1]),
        dated=frozenset(k for k, field in enumerate(fields) if _is_stamp(field)),
        synthetic="synthetic" in "".join(line for line in above if line.lstrip().startswith("#")).casefold(),
    )  # fmt: skip


def _refuse_thousands(cell: str) -> NoReturn:
    sign = "comma" if "," in cell else "point"
    remedy = "save the file with decimal points and without signs between thousands"
    raise InputError(f"the {sign} in {shown(cell)} may mark decimals or thousands; {remedy}.")


def refuse_fields(line: str, number: int, names: Sequence[str], separator: str, header: str) -> NoReturn:
    """Refuse (`InputError`) a row that has not as many fields as the header has names."""
    where = f"line {number} ({shown(line)})"
    if line.lstrip().startswith("#"):
        raise InputError(f"{where} is a comment among the rows; remove the line.")
    fields = split_fields(line, separator, len(names))
    between = f"{where} has {len(fields)} fields between {SEPARATORS[separator]} and {header} has {len(names)} names"
    whole = len(fields) > len(names) and all(re.fullmatch(r"-?\d+", field) for field in fields)
    remedy = "; complete or remove it, use one separator everywhere, give all columns by number, such as "
    remedy += "`time: 1, axes: {ay: 3}`, or, if some rows are no samples, `gaps: longest`"
    if separator == "," and (are_split(fields) or whole):
        remedy = f": decimal commas among commas{', or names are missing' * whole}; save it with decimal points, or "
        remedy += f"with semicolons or tabs between the columns{', or complete the names' * whole}"
    raise InputError(f"{between} ({joined(names)}){remedy}.")


def are_split(fields: Sequence[str]) -> bool:
    """Return whether fields between commas look like numbers that a decimal comma has split: -0 and 5064."""
    return any(re.fullmatch(r"-0,\d+|-?\d+,0\d+", ",".join(pair)) for pair in pairwise(fields))


def joined(names: Sequence[str]) -> str:
    """Join names of columns for a message, at most twelve."""
    return (", ".join(map(shown, names[:12])) + ", ..." * (len(names) > 12)) or "columns without names"
