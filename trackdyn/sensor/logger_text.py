"""The text of a data logger's CSV file to columns of numbers.

Loggers, spreadsheets and apps differ in separators, decimal signs, comments, quotes and what stands above the header.
What can be read in one way only is read; for anything else one sentence says what is doubtful.
"""

import csv
import io
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, shown

MOST_BYTES = 128_000_000  # an hour of three axes at 1 kHz; the text and its numbers take some ten times that
_WIDE = (b"\xff\xfe", b"\xfe\xff")  # marks of UTF-16
_HEAD = 200  # lines in which the header is looked for
_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d{1,9})?)?(Z|[+-]\d\d(:?\d\d)?)?", re.ASCII)  # ISO 8601
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+", re.ASCII)


class Layout(NamedTuple):
    """Where what stands in a file."""

    path: Path  # the file
    # names, units: of the columns: the header, and a row of units below it or empty texts
    names: list[str]
    units: list[str]
    separator: str  # between the fields
    first_line: int  # line of the first row of numbers, from 1
    body: str  # the rows, without what ends the file


def read_logger_text(path: Path) -> str:
    """A whole text file of at most ``MOST_BYTES``, with plain newlines.

    UTF-8, UTF-16 with its mark, or Latin-1: numbers are the same in all of them, units may hold other letters.
    """
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: this is a folder or a device, not a file; give one CSV file.")
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"{path}: the file does not exist; check the path.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no usable name"
        raise InputError(f"{path}: the file cannot be read ({reason}); check its name and permissions.") from None
    if data.startswith(b"PK"):
        kind = "a recording" if data[30:38] == b"meta.npy" else "an archive or a spreadsheet"
        raise InputError(f"{path}: this is {kind}, not a sensor's file; give a CSV file.")
    if sum(byte < 9 for byte in data[:1000]) > 0.1 * len(data[:1000]) and not data.startswith(_WIDE):
        raise InputError(f"{path}: this is binary data, not text; export it as CSV.")
    if len(data) > MOST_BYTES:
        raise InputError(f"{path}: the file holds more than {MOST_BYTES / 1e6:.0f} MB; give a part of it.")
    try:
        text = data.decode("utf-16" if data.startswith(_WIDE) else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def split_fields(line: str, separator: str, count: int = 0) -> list[str]:
    """Fields of a line without quotes and blanks around them; empty ones at the end beyond ``count`` are dropped."""
    try:
        found = [
            f.strip(" \t'") for f in next(csv.reader([line.strip(" ")], delimiter=separator, skipinitialspace=True), [])
        ]
    except csv.Error:
        found = [line]
    while len(found) > count and not found[-1]:
        found.pop()
    return found


def _is_number(field: str) -> bool:
    return bool(_NUMBER.fullmatch(field.replace(",", ".", 1)) or _NOT_FINITE.fullmatch(field))


def find_layout(path: Path, text: str, recognised: Callable[[Sequence[str]], bool], sought: str) -> Layout:
    """Find header and rows.

    The header is the first line, perhaps behind a ``#``, whose names are ``recognised`` and are as many as the fields
    of the row that follows. Where a file begins with numbers its columns are named "1", "2" and so on. ``sought`` says
    in a refusal what was not found. Raises `InputError`: no line is such a header.
    """
    head = text.split("\n", _HEAD)[:_HEAD]
    rows = [i for i, line in enumerate(head) if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        what = "holds comments only" if text.strip() else "is empty"
        raise InputError(f"{path}: the file {what}; it must hold a header such as 't_s,ax_g,ay_g,az_g', and rows.")
    unequal = None
    for i, line in enumerate(head):
        line = line.strip(" ")
        if line.startswith("#"):
            line = line.lstrip("#").strip()
        for separator in [one for one in _SEPARATORS if one in line] or [" "]:
            names, below = split_fields(line, separator), [j for j in rows if j > i]
            if not recognised(names):
                continue
            units = [""] * len(names)
            if len(below) > 1:
                row = split_fields(head[below[0]], separator)
                if len(row) == len(names) and not any(map(_is_number, row)):
                    units = row
                    del below[0]
            if not below or len(split_fields(head[below[0]], separator, len(names))) == len(names):
                first = below[0] if below else len(head)
                return Layout(path, names, units, separator, first + 1, _body(text, first))
            if i in rows:
                unequal = unequal or (i, names, separator, below[0])
    if unequal:
        i, names, separator, first = unequal
        _refuse_fields(path, head[first], first + 1, names, separator, f"the header in line {i + 1}")
    separator = next((one for one in _SEPARATORS if one in head[rows[0]]), " ")
    found = split_fields(head[rows[0]], separator)
    if all(map(_is_number, found)):
        names = [str(k + 1) for k in range(len(found))]
        if recognised(names):
            return Layout(path, names, [""] * len(names), separator, rows[0] + 1, _body(text, rows[0]))
        raise InputError(
            f"{path}: line {rows[0] + 1} holds numbers ({shown(head[rows[0]])}) where the names of the columns must "
            "be; write them above, or give columns by number, such as --time 1 --axis ay=3 --unit g."
        )
    # what looks most like a header is shown: the line above the first row of numbers
    first = next((k for k, j in enumerate(rows) if k and all(map(_is_number, split_fields(head[j], separator)))), 1)
    above = rows[first - 1]
    raise InputError(
        f"{path}: no {sought} in line {above + 1} ({listed(split_fields(head[above], separator))}); say which it "
        "is with --axis ay=NAME, or --axis ay=-NAME to turn its sign."
    )


def is_dated(layout: Layout, column: int) -> bool:
    """Whether the first row has a date and time (ISO 8601) in a column."""
    fields = split_fields(layout.body.partition("\n")[0], layout.separator, len(layout.names))
    return len(fields) > column and bool(_DATE.fullmatch(fields[column]))


def parse(layout: Layout, columns: Sequence[int]) -> np.ndarray:
    """(N, c) numbers of some columns, dates and times as s since the first row; `InputError` for the first defect."""
    if dated := [column for column in columns if is_dated(layout, column)]:
        rest = parse(layout, [column for column in columns if column not in dated])
        return np.insert(rest, columns.index(dated[0]), _seconds(layout, dated[0]), axis=1)
    decimal = _decimal_sign(layout, columns)
    table = _parse_fast(layout, list(columns), decimal)
    return _parse_by_line(layout, columns, decimal) if table is None else table


def _body(text: str, first: int) -> str:
    """Text from line ``first`` (from 0) on, without blank and comment lines and old editors' marks at its end."""
    position = 0
    for _ in range(first):
        position = text.find("\n", position) + 1 or len(text)
    body = text[position:].rstrip(" \n\x1a")
    while body[(cut := body.rfind("\n") + 1) :].lstrip().startswith("#"):
        body = body[:cut].rstrip(" \n\x1a")
    return body


def _seconds(layout: Layout, column: int) -> np.ndarray:
    """Seconds since the first row of a column of dates and times."""
    lines, separator = layout.body.split("\n"), layout.separator
    split = split_fields if '"' in layout.body or separator == " " else str.split
    texts = [split(line, separator)[column].strip(" \t'").replace(",", ".") for line in lines]
    found = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
    if found.hasnans or not all(map(_DATE.fullmatch, texts)):
        k = next(k for k, text in enumerate(texts) if not _DATE.fullmatch(text) or found[k] is pd.NaT)
        raise InputError(
            f"{layout.path}: field {layout.names[column]} in line {layout.first_line + k} is {shown(texts[k])}, not a "
            "date and time as 2024-05-01T12:00:00.001; correct it."
        )
    return (found - found[0]).to_numpy() / np.timedelta64(1, "s")


def _decimal_sign(layout: Layout, columns: Sequence[int]) -> str:
    head = (split_fields(line, layout.separator) for line in layout.body.split("\n", 100)[:100])
    commas = [field for fields in head for k, field in enumerate(fields) if k in columns and "," in field]
    if commas and all(map(_GROUPED.fullmatch, commas)):
        raise InputError(
            f"{layout.path}: the comma in {shown(commas[0])} may mark decimals or thousands; save the "
            "file with decimal points."
        )
    return "," if commas else "."


def _parse_fast(layout: Layout, columns: list[int], decimal: str) -> np.ndarray | None:
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
            warnings.simplefilter("error", pd.errors.ParserWarning)  # of fields that would be lost
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
    return table if len(table) == rows and np.all(np.isfinite(table)) else None


def _parse_by_line(layout: Layout, columns: Sequence[int], decimal: str) -> np.ndarray:
    """The numbers line by line, or the sentence for the first defect."""
    path, names, separator = layout.path, layout.names, layout.separator
    lines = layout.body.split("\n") if layout.body else []
    table = np.empty((len(lines), len(columns)))
    for k, line in enumerate(lines):
        number = layout.first_line + k
        fields = split_fields(line, separator, len(names))
        if len(fields) != len(names):
            _refuse_fields(path, line, number, names, separator, "the file", last=k == len(lines) - 1)
        for column, index in enumerate(columns):
            where, value = f"{path}: field {names[index]} in line {number}", fields[index]
            if not value:
                raise InputError(f"{where} is empty ({shown(line)}); supply the number.")
            if _NOT_FINITE.fullmatch(value):
                raise InputError(f"{where} is {shown(value)}, not a finite number; record the sample again.")
            if not _NUMBER.fullmatch(value.replace(".", "?").replace(",", ".") if decimal == "," else value):
                kind = "decimal comma, as the first rows have it" if decimal == "," else "decimal point"
                raise InputError(f"{where} is {shown(value)}, not a number; write it with a {kind}.")
            table[k, column] = float(value.replace(",", "."))
            if not np.isfinite(table[k, column]):
                raise InputError(f"{where} is {shown(value)}, too large for a number; correct it.")
    return table


def _refuse_fields(path, line, number, names, separator, what, last=False):
    """Say why a row has not as many fields as the header has names."""
    where = f"{path}: line {number} ({shown(line)})"
    if not line.strip():
        raise InputError(f"{where} is empty where a row must be; remove the line.")
    if line.lstrip().startswith("#"):
        raise InputError(f"{where} is a comment among the rows; remove it.")
    found = len(split_fields(line, separator, len(names)))
    for other, name in _SEPARATORS.items():
        if other not in (separator, " ") and other in line and len(split_fields(line, other)) == len(names):
            raise InputError(
                f"{where} has {name} where {what} has {_SEPARATORS[separator]}; write the same everywhere."
            )
    if separator == "," and found == 2 * len(names):
        raise InputError(
            f"{where} has {found} fields for {len(names)} names, these look like decimal commas; separate the fields "
            "by semicolons or write decimal points."
        )
    if found > len(names):
        raise InputError(f"{where} has {found} fields for the {len(names)} names {listed(names)}; remove the rest.")
    kind = "the last line is truncated" if last else "the line is incomplete"
    raise InputError(
        f"{where} has {found} of {len(names)} fields and ends before {names[found]}, {kind}; complete or remove it."
    )


def listed(names: Sequence[str]) -> str:
    """Names of columns as they may stand in a sentence."""
    return ", ".join(map(shown, names[:8])) + (", ..." if len(names) > 8 else "")
