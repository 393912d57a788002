"""Cells of the article's Tables 2 to 4 that our text of it lacks.

A reader who has the article fills them in (``config/article.csv``); an empty cell leaves its claims not comparable.
"""

from itertools import product
from math import inf, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from replication.paper import printed
from trackdyn.inputs.errors import InputError, shown
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
    """Read the cells that are filled in, from a CSV file ``table,row,column,value`` with a row for every cell.

    Raises `InputError`: other rows, a value that is no positive number, or an RMS or SD that contradicts the
    differences that the text prints.
    """
    table = read_table(path)
    names = [*Cell._fields]
    if [*table.columns] != [*names, "value"] or table[names].values.tolist() != [[*cell] for cell in CELLS]:
        raise InputError(f"{path}: its cells are not those of config/article.csv in the repository; change values only")
    values = pd.to_numeric(table["value"].replace("", "nan"), errors="coerce")
    filled = table["value"] != ""
    if (wrong := filled & ~values.between(0, inf, inclusive="neither")).any():
        k = int(wrong.argmax())
        raise InputError(f"{path}: {CELLS[k]} = {shown(table['value'][k])}: must be a number above 0, or empty")
    cells = {cell: float(value) for cell, value, here in zip(CELLS, values, filled, strict=True) if here}
    for rpm, name in product(printed.SPEEDS_RPM, PAIRS):
        pair = [Cell("3", str(rpm), column) for column in PAIRS[name]]
        difference, known = value_difference(*(cells.get(cell, nan) for cell in pair)), printed.DIFFERENCES[name][rpm]
        if abs(difference - known) > ROUNDED_DIFFERENCE:
            raise InputError(
                f"{path}: {pair[0]} and {pair[1].column} differ by {difference:.3g} %; printed is {known:g} %, correct "
                "them"
            )
    return cells


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured
