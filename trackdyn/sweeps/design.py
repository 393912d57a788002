"""Tables of designs and results: strict CSV."""

import csv
import io
from pathlib import Path

import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import read_text
from trackdyn.inputs.validation import shown

MAX_CSV_BYTES = 500_000_000


def check_ending(path: Path | str, option: str) -> None:
    """Refuse (`InputError`) the name of a table that does not end in .csv."""
    if not isinstance(path, Path | str) or Path(path).suffix != ".csv":
        raise InputError(f"{option} = {shown(str(path))}: the name must end in .csv")


def read_table(path: Path | str) -> pd.DataFrame:
    """Read a CSV table as text; `InputError`: duplicate names, ragged rows, or the file is too large."""
    check_ending(path, "table")
    reader = csv.reader(io.StringIO(read_text(path, "CSV file", MAX_CSV_BYTES), newline=""), strict=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num} is not CSV ({error}); correct its quotes") from None
    (_, header), *body = [(line, row) for line, row in rows if any(row)] or [(1, [])]
    check_header(header, str(path))
    for line, row in body:
        if len(row) != len(header):
            semicolons = len(header) == 1 and ";" in header[0]
            remedy = "separate cells by commas, not semicolons" if semicolons else "put text with a comma into quotes"
            raise InputError(f"{path}: line {line} has {len(row)} cells and the header {len(header)}; {remedy}")
    return pd.DataFrame([row for _, row in body], columns=header, dtype=str)


def check_header(names: list, source: str) -> None:
    """Refuse (`InputError`) a table without columns, or with duplicate names."""
    if not names:
        raise InputError(f"{source}: is empty; a header with the names of columns is needed")
    for name in names:
        if not isinstance(name, str) or not name:
            raise InputError(f"{source}: has a column without a name; give it one")
        if names.count(name) > 1:
            raise InputError(f"{source}: has the column {shown(name)} twice; keep one of them")
