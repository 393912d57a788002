"""Tables of designs and results (CSV or Parquet, read whole or refused in one sentence), and how to make designs."""

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.extras import required
from trackdyn.files import plain_file, read_text, replacing
from trackdyn.parameters.validation import parse_number, plain_number, shown

LARGEST = 500_000_000  # bytes of a CSV, and of a Parquet file as it unpacks
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
        rows = _csv_rows(path)
        header: list[str] = next(rows, [])
        check_header(header, str(path))
        cells = []
        for line, row in rows:
            if len(row) != len(header):
                raise InputError(
                    f"{path}: line {line} has {len(row)} cells and the header {len(header)}; put text "
                    "with a comma into quotes"
                )
            cells.append([cell.strip() for cell in row])
        return pd.DataFrame(cells, columns=header, dtype=str)
    plain_file(path, "Parquet file")
    pyarrow, parquet = required("pyarrow"), required("pyarrow.parquet")
    try:
        described = parquet.read_metadata(path)
        size = sum(described.row_group(k).total_byte_size for k in range(described.num_row_groups))
        names = parquet.read_schema(path).names
        table = pd.read_parquet(path) if size <= LARGEST else None
    except (pyarrow.ArrowException, OSError, ValueError, TypeError, KeyError):
        raise InputError(f"{path}: not a Parquet file, or damaged") from None
    if table is None:
        raise InputError(f"{path}: takes {size / 1e6:.0f} MB as it unpacks, more than {LARGEST / 1e6:.0f} MB; split it")
    check_header([name for name in names if name in table.columns], str(path))
    return table.reset_index(drop=True)


def _csv_rows(path: Path | str) -> Iterator:
    """The header, then number of the line and cells of every row that is not empty."""
    text = read_text(path, "CSV file", LARGEST)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    header = None
    try:
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if header is None:
                header = [cell.strip() for cell in row]
                yield header
            else:
                yield reader.line_num, row
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num} is no CSV ({error}); correct its quotes") from None


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


METHODS = ("grid", "sobol", "latin")
MOST_ROWS = 1_000_000
# name=low:high, name=low:high:count, name=a,b,c
_RANGE = re.compile(r"([^:,]+):([^:,]+)(?::(\d+))?")


class Span:
    """A range of a number, both ends included, to be sampled or cut into ``count`` levels of a grid."""

    def __init__(self, low: float, high: float, count: int | None = None):
        self.low, self.high, self.count = float(low), float(high), count
        if not self.low < self.high:
            raise InputError(f"range {low:g}:{high:g}: the second number must be the larger one")
        if count is not None and not 2 <= count <= MOST_ROWS:
            raise InputError(f"range {low:g}:{high:g}:{count}: the count must be between 2 and {MOST_ROWS}")

    def levels(self, name: str) -> list[float]:
        """The values of a grid."""
        if self.count is None:
            raise InputError(
                f"{name} = {self.low:g}:{self.high:g} needs a count for a grid, such as {self.low:g}:{self.high:g}:5"
            )
        return np.linspace(self.low, self.high, self.count).tolist()


def parse_levels(pair: str, option: str = "--vary") -> tuple[str, Span | list[str]]:
    """Name and levels of ``motor_rpm=115:210``, ``motor_rpm=115:210:5`` or ``friction=a,b``; or `InputError`."""
    name, _, text = pair.partition("=")
    name, text = name.strip(), text.strip()
    if not name or not text:
        raise InputError(f"{option} = {shown(pair)}: expected name=low:high, name=low:high:count or name=a,b")
    if match := _RANGE.fullmatch(text):
        try:
            low, high = (plain_number(parse_number(text_of_level)) for text_of_level in match.groups()[:2])
        except ValueError:
            raise InputError(f"{option} = {shown(pair)}: expected two finite numbers, such as 115:210") from None
        return name, Span(low, high, int(match[3]) if match[3] else None)
    return name, [text_of_level.strip() for text_of_level in text.split(",")]


def make_design(
    vary: Mapping[str, Span | Sequence],
    method: str = "sobol",
    rows: int | None = None,
    seed: int = 0,
    fixed: Mapping[str, object] | None = None,
) -> pd.DataFrame:
    """A design over columns of a sweep.

    Parameters
    ----------
    vary : mapping
        Column and what it takes: a `Span` (or a pair of numbers) or a list of levels.
    method : str
        ``grid`` (all levels with all), ``sobol`` (a scrambled Sobol sequence) or ``latin`` (a Latin hypercube), both by
        `scipy.stats.qmc`.
    rows : int or None
        Rows of a Sobol or Latin design; a power of 2 keeps a Sobol sequence balanced.
    seed : int
        Of the scrambling; the same seed gives the same design.
    fixed : mapping
        Columns with one value.

    Raises
    ------
    InputError
        A method, range, number of rows or column that does not make a design.

    Examples
    --------
    ``make_design({"motor_rpm": (115, 210), "ring_radius": (0.303, 0.313)}, rows=64, fixed={"duration": 20})``
    """
    if not vary:
        raise InputError("a design must vary something, such as --vary motor_rpm=115:210")
    fixed = dict(fixed or {})
    if both := vary.keys() & fixed.keys():
        raise InputError(f"{min(both)} is varied and fixed; keep one of them")
    spans = {name: Span(*takes) if isinstance(takes, tuple) else takes for name, takes in vary.items()}
    if method == "grid":
        if rows is not None:
            raise InputError(
                f"rows = {rows}: the levels of a grid give its rows; leave rows out or choose another method"
            )
        levels = [takes.levels(name) if isinstance(takes, Span) else list(takes) for name, takes in spans.items()]
        _check_rows(int(np.prod([len(level) for level in levels], dtype=float)))
        table = pd.DataFrame(list(product(*levels)), columns=list(spans), dtype=object)
    elif method in METHODS:
        _check_rows(rows)
        shares = _shares(method, len(spans), rows, seed)
        table = pd.DataFrame(
            {
                name: takes.low + (takes.high - takes.low) * share
                if isinstance(takes, Span)
                else np.array(takes, dtype=object)[(share * len(takes)).astype(int)]
                for (name, takes), share in zip(spans.items(), shares.T, strict=True)
            }
        )
    else:
        raise InputError(f"method = {shown(method)}: choose {', '.join(METHODS)}")
    return table.assign(**fixed)


def _check_rows(rows: int | None) -> None:
    if isinstance(rows, bool) or not isinstance(rows, (int, np.integer)) or not 1 <= rows <= MOST_ROWS:
        raise InputError(f"rows = {shown(rows)}: a design needs a number of rows from 1 to {MOST_ROWS}, such as 64")


def _shares(method: str, columns: int, rows: Any, seed: int) -> np.ndarray:
    """(rows, columns) points of the unit cube."""
    from scipy.stats import qmc  # takes half a second

    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InputError(f"seed = {shown(seed)}: must be a whole number of at least 0")
    if method == "latin":
        return qmc.LatinHypercube(columns, seed=seed).random(rows)
    sampler = qmc.Sobol(columns, seed=seed)
    return sampler.random_base2(int(np.ceil(np.log2(rows))))[:rows]
