"""Tables of designs and results, CSV or Parquet: read whole, or refused in one sentence."""

import csv
import io
from pathlib import Path

import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.extras import required
from trackdyn.inputs.files import plain_file, read_text, replacing
from trackdyn.inputs.validation import shown

MAX_TABLE_BYTES = 500_000_000  # bytes of a CSV, and of a Parquet file as it unpacks
ENDINGS = (".csv", ".parquet")


def check_ending(path: Path | str, option: str) -> None:
    """Refuse (`InputError`) the name of a table that ends in neither .csv nor .parquet, or .parquet without pyarrow."""
    if not isinstance(path, Path | str) or Path(path).suffix not in ENDINGS:
        raise InputError(f"{option} = {shown(str(path))}: the name must end in {' or '.join(ENDINGS)}")
    if Path(path).suffix == ".parquet":
        required("pyarrow")


def read_table(path: Path | str) -> pd.DataFrame:
    """A table as it stands (a CSV's cells are text); `InputError` for names twice, ragged rows, or too large a file."""
    check_ending(path, "table")
    if Path(path).suffix == ".csv":
        return _read_csv(path)
    plain_file(path, "Parquet file")
    pyarrow, parquet = required("pyarrow"), required("pyarrow.parquet")
    try:
        described = parquet.read_metadata(path)
        size = sum(described.row_group(k).total_byte_size for k in range(described.num_row_groups))
        names = parquet.read_schema(path).names
        table = pd.read_parquet(path) if size <= MAX_TABLE_BYTES else None
    except (pyarrow.ArrowException, OSError, ValueError, TypeError, KeyError):
        raise InputError(f"{path}: not a Parquet file, or damaged") from None
    if table is None:
        most = MAX_TABLE_BYTES / 1e6
        raise InputError(f"{path}: takes {size / 1e6:.0f} MB as it unpacks, more than {most:.0f} MB; split it")
    check_header([name for name in names if name in table.columns], str(path))
    return table.reset_index(drop=True)


def _read_csv(path: Path | str) -> pd.DataFrame:
    reader = csv.reader(io.StringIO(read_text(path, "CSV file", MAX_TABLE_BYTES), newline=""), strict=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num} is no CSV ({error}); correct its quotes") from None
    (_, header), *body = [(line, row) for line, row in rows if any(row)] or [(1, [])]
    check_header(header, str(path))
    for line, row in body:
        if len(row) != len(header):
            semicolons = len(header) == 1 and ";" in header[0]
            remedy = "separate cells by commas, not semicolons" if semicolons else "put text with a comma into quotes"
            raise InputError(f"{path}: line {line} has {len(row)} cells and the header {len(header)}; {remedy}")
    return pd.DataFrame([row for _, row in body], columns=header, dtype=str)


def check_header(names: list, where: str) -> None:
    """Refuse (`InputError`) a table without columns, or with two of one name."""
    if not names:
        raise InputError(f"{where}: is empty; a header with the names of columns is needed")
    for name in names:
        if not isinstance(name, str) or not name:
            raise InputError(f"{where}: has a column without a name; give it one")
        if names.count(name) > 1:
            raise InputError(f"{where}: has the column {shown(name)} twice; keep one of them")


def write_table(table: pd.DataFrame, path: Path | str) -> None:
    """Write CSV or Parquet, by the ending; whole or not at all. Raises `InputError`: it cannot be written."""
    check_ending(path, "table")
    with replacing(path) as temporary:
        if Path(path).suffix == ".csv":
            table.to_csv(temporary, index=False)
        else:
            table.to_parquet(temporary, index=False, engine="pyarrow")
