"""Cells of the article's Tables 2 to 4 that our text of it lacks.

A reader who has the article fills them in (``config/article.csv``); an empty cell leaves its claims not comparable.
"""

from contextlib import suppress
from itertools import product
from math import inf, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from replication.paper import printed
from trackdyn.errors import InputError, shown
from trackdyn.rig.validation import parse_number
from trackdyn.sweeps.design import read_table


class Cell(NamedTuple):
    """Name of a cell of the article's tables."""

    table: str
    row: str
    column: str

    def __str__(self) -> str:
        return f"table {self.table}, row {self.row}, column {self.column}"


TIMES = (Cell("2", "one simulation", "proposed_s"), Cell("2", "one simulation", "recurdyn_s"))
PAIRS = {name: (f"{name}_simulation_g", f"{name}_experiment_g") for name in ("rms", "sd")}  # columns of Table 3
COLUMNS = {"3": (*PAIRS["rms"], *PAIRS["sd"]), "4": ("rms_g",)}
CELLS = TIMES + tuple(
    Cell(table, str(rpm), name) for table, names in COLUMNS.items() for rpm in printed.SPEEDS_RPM for name in names
)
# points by which printed cells may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1


def load_cells(path: Path | str) -> dict[Cell, float]:
    """Read the cells that are filled in, from a CSV file ``table,row,column,value``.

    Raises
    ------
    InputError
        A cell that the article does not have, one given twice, a value that is no positive number, one computing time
        without the other, or an RMS or SD that contradicts the differences that the text prints.
    """
    table, cells = read_table(path), {}
    if list(table.columns) != [*Cell._fields, "value"]:
        raise InputError(f"{path}: has the columns {', '.join(table.columns)}; needed are table,row,column,value")
    for *names, text in table.itertuples(index=False):
        cell = Cell(*names)
        if cell not in CELLS:
            raise InputError(f"{path}: {cell} is no cell; those of config/article.csv in the repository are accepted")
        if not text:
            continue
        if cell in cells:
            raise InputError(f"{path}: {cell} is given twice; keep one of its rows")
        with suppress(ValueError):
            cells[cell] = parse_number(text)
        if not 0 < cells.get(cell, 0.0) < inf:
            raise InputError(f"{path}: {cell} = {shown(text)}: must be a number above 0, or empty")
    for cell, other in (TIMES, TIMES[::-1]):
        if cell in cells and other not in cells:
            raise InputError(f"{path}: {other} is empty and {cell.column} is given: give both times, or none")
    for rpm, name in product(printed.SPEEDS_RPM, PAIRS):
        pair = [Cell("3", str(rpm), column) for column in PAIRS[name]]
        simulated, measured = (cells.get(cell, nan) for cell in pair)
        difference, known = value_difference(simulated, measured), printed.DIFFERENCES[name][rpm]
        if abs(difference - known) > ROUNDED_DIFFERENCE:
            raise InputError(
                f"{path}: {pair[0]} = {simulated:g} and {pair[1].column} = {measured:g} differ by {difference:.3g} "
                f"% where the text prints {known:g} %; cells that differ as printed are accepted"
            )
    return cells


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured
