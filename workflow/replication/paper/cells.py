"""Cells of the article's Tables 2 to 4 that our text of it lacks, and the measures of claims that need them.

A reader who has the article fills them in (``config/article.csv``); an empty cell leaves its claims not comparable.
"""

from math import isfinite
from pathlib import Path

import numpy as np

from replication.paper import printed
from replication.paper.evidence import Cell, Evidence, NotThere
from replication.paper.measures import coarse_rms_difference, measure, register_all
from trackdyn.errors import InputError, shown
from trackdyn.rig.validation import parse_number
from trackdyn.sweeps.design import read_table

TIMES = (Cell("2", "one simulation", "proposed_s"), Cell("2", "one simulation", "recurdyn_s"))
COLUMNS = {
    "3": [f"{value}_{source}_g" for value in ("rms", "sd") for source in ("simulation", "experiment")],
    "4": ["rms_g"],
}
CELLS = (
    *TIMES,
    *(Cell(table, str(rpm), name) for table, names in COLUMNS.items() for rpm in printed.SPEEDS_RPM for name in names),
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
        try:
            cells[cell] = parse_number(text)
        except ValueError:
            cells[cell] = float("nan")
        if not (isfinite(cells[cell]) and cells[cell] > 0):
            raise InputError(f"{path}: {cell} = {shown(text)}: must be a number above 0, or empty")
    for cell, other in (TIMES, TIMES[::-1]):
        if cell in cells and other not in cells:
            raise InputError(f"{path}: {other} is empty and {cell.column} is given: give both times, or none")
    for name, text in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
        for rpm, known in text.items():
            pair = [Cell("3", str(rpm), f"{name}_{source}_g") for source in ("simulation", "experiment")]
            if not {*pair} <= cells.keys():
                continue
            simulated, measured = (cells[cell] for cell in pair)
            difference = value_difference(simulated, measured)
            if abs(difference - known) > ROUNDED_DIFFERENCE:
                raise InputError(
                    f"{path}: {pair[0]} = {simulated:g} and {pair[1].column} = {measured:g} differ by {difference:.3g} "
                    f"% where the text prints {known:g} %; cells that differ as printed are accepted"
                )
    return cells


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured


def _by_speed(e: Evidence, table: str, column: str, speeds) -> np.ndarray:
    """Cells of a column at some speeds; `NotThere` names those that are empty."""
    cells = [Cell(table, f"{rpm:g}", column) for rpm in speeds]
    if missing := [cell.row for cell in cells if cell not in e.cells]:
        raise NotThere(f"Table {table} is not filled in: {column} at {', '.join(missing)} rpm")
    return np.array([e.cells[cell] for cell in cells])


def _against(what, e, speeds):
    """Difference of a column of our records from a column of Table 3, % of the latter."""
    ours, column = what
    return value_difference(e.records(speeds)[ours], _by_speed(e, "3", column, speeds)).tolist()


register_all(
    _against, "records", by_speed=True,
    rms_against_experiment=("rms_g", "rms_experiment_g"), sd_against_experiment=("sd_g", "sd_experiment_g"),
    rms_against_simulation=("rms_g", "rms_simulation_g"), sd_against_simulation=("sd_g", "sd_simulation_g"),
)  # fmt: skip


@measure("records", by_speed=True)
def coarse_less_accurate(e, speeds):
    """How much farther from the article's measured RMS three surfaces are than ten arcs, points."""
    measured, fine = _by_speed(e, "3", "rms_experiment_g", speeds), e.records(speeds)["rms_g"].to_numpy()
    coarse = fine * (1 + np.array(coarse_rms_difference(e, speeds)) / 100)
    return (value_difference(coarse, measured) - value_difference(fine, measured)).tolist()


@measure("records", by_speed=True)
def coarse_change_over_printed(e, speeds):
    """Change of the RMS by three surfaces less that by the algorithm of Ref. [2] in the article, points."""
    change = 100 * (_by_speed(e, "4", "rms_g", speeds) / _by_speed(e, "3", "rms_simulation_g", speeds) - 1)
    return (np.array(coarse_rms_difference(e, speeds)) - change).tolist()


@measure("peer")
def speed_over_printed(e, speeds):
    """CPU time of the independent code over ours at equal accuracy, over Recurdyn's over the article's."""
    if not {*TIMES} <= e.cells.keys():
        raise NotThere("Table 2 is not filled in")
    chosen = e.costs[e.costs["chosen"] == "yes"].set_index("code")["cpu_s_per_s"] if "chosen" in e.costs else {}
    if not {"trackdyn", "exudyn"} <= set(getattr(chosen, "index", ())):
        raise NotThere("not run")
    return float(chosen["exudyn"] / chosen["trackdyn"] * e.cells[TIMES[0]] / e.cells[TIMES[1]])
