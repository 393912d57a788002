"""The cells of the article that our text of it lacks (``config/rigs/paper/tables.yaml``), as a reader fills them in.

Every cell may be null. Tables 2 to 4 concern claims; what the others say of a rig becomes one (`printed_rig`).
"""

from decimal import Decimal
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from replication.paper import printed
from trackdyn.errors import InputError
from trackdyn.parameters.groove import CONVEX
from trackdyn.parameters.outline import rounding
from trackdyn.parameters.validation import Section, plain_number, shown, validated
from trackdyn.parameters.yaml_file import read_yaml

# points by which printed cells may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1
AREAS = range(1, 11)
SIGNS = np.array([1.0 if area in CONVEX else -1.0 for area in range(1, 6)])
FACTORS = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": pi / 180}
G = 9.81  # m/s2, as the article takes it (Eq. 40)
LENGTHS = ("chain.link_length", "L_C", "pitch", "r_p")  # of which two give all
AXIAL = ("t_S", "t_C")
OWN = ("r_a", "r_p", "L_C", "pitch", *AXIAL)  # what the article names and a rig has no field for


def _or_null(cell: Any) -> Any:
    return None if cell is None else plain_number(cell)


def _or_word(cell: Any) -> Any:
    return cell if isinstance(cell, str) else _or_null(cell)


Number = Annotated[float | None, BeforeValidator(_or_null)]
Above = Annotated[Annotated[float, Field(gt=0)] | None, BeforeValidator(_or_null)]
Word = Annotated[float | str | None, BeforeValidator(_or_word)]


class Area(Section):
    """A row of Table 1: centre, radius, direction to the middle and spread angle of an area."""

    O_x: Number = None
    O_y: Number = None
    r: Above = None
    u_x: Number = None
    u_y: Number = None
    theta: Above = None


class UnitsOfTable1(Section):
    """Units of Table 1."""

    O: Literal["m", "mm"]  # noqa: E741 -- the article's name
    r: Literal["m", "mm"]
    theta: Literal["rad", "deg"]


class Table1(Section):
    """Areas of the groove."""

    place: str
    units: UnitsOfTable1
    areas: dict[Annotated[int, Field(ge=1, le=10)], Area]


class Table2(Section):
    """Computing times."""

    place: str
    unit: Literal["s"]
    proposed: Above = None
    recurdyn: Above = None


class Statistics(Section):
    """A row of Table 3."""

    rms_simulation: Above = None
    rms_experiment: Above = None
    sd_simulation: Above = None
    sd_experiment: Above = None


class Coarse(Section):
    """A row of Table 4."""

    rms: Above = None


class Table3(Section):
    """RMS and standard deviation by motor speed."""

    place: str
    unit: Literal["g", "m/s2"]
    speeds: dict[Annotated[int, Field(gt=0)], Statistics]


class Table4(Section):
    """RMS with a coarser tooth contact, by motor speed."""

    place: str
    unit: Literal["g", "m/s2"]
    speeds: dict[Annotated[int, Field(gt=0)], Coarse]


class Parameter(Section):
    """A number outside the tables, under the name of a rig's field or one of ``OWN``."""

    value: Word = None
    unit: str
    name: str
    place: str


class PaperTables(Section):
    """``config/rigs/paper/tables.yaml``: the cells of Tables 1 to 4, and parameters."""

    table1: Table1
    table2: Table2
    table3: Table3
    table4: Table4
    parameters: dict[str, Parameter]

    def statistics(self, name: str) -> dict[int, float]:
        """Filled cells of a column of Table 3 or, as ``coarse_rms``, of Table 4 by motor speed (rev/min), g."""
        table, column = (self.table4, "rms") if name == "coarse_rms" else (self.table3, name)
        scale = 1.0 if table.unit == "g" else 1 / G
        cells = {rpm: getattr(row, column) for rpm, row in table.speeds.items()}
        return {rpm: scale * value for rpm, value in cells.items() if value is not None}


def load_article(path: Path | str) -> PaperTables:
    """Read the cells, compared with the differences that the text prints.

    Raises `InputError`: what is half filled, contradicts itself or the text, in one sentence.
    """
    tables = _load(path)
    for name, text in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
        simulated, measured = (tables.statistics(f"{name}_{source}") for source in ("simulation", "experiment"))
        for rpm in sorted(simulated.keys() & measured.keys() & text.value.keys()):
            difference = value_difference(simulated[rpm], measured[rpm])
            if abs(difference - text.value[rpm]) > ROUNDED_DIFFERENCE:
                raise InputError(
                    f"{path}: table3.speeds.{rpm}.{name}_simulation = {simulated[rpm]:.6g} g and {name}_experiment = "
                    f"{measured[rpm]:.6g} g differ by {difference:.3g} % where the text prints {text.value[rpm]:g} %; "
                    "cells that differ as printed are accepted"
                )
    return tables


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured


def _load(path: Path | str) -> PaperTables:
    tables = validated(PaperTables, read_yaml(path), str(path), "leave the cell at null if the article has none")
    try:
        table1_arcs(tables.table1)
        _refuse_halves(tables)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return tables


LONGEST_M = 1000.0  # m, as of every length of a rig


def table1_arcs(table: Table1) -> list[list[float]] | None:
    """Rows of `profile.arcs` (m) that Table 1 gives, or None if it is empty; the right flank mirrors the left one."""
    rows = {area: table.areas.get(area, Area()) for area in AREAS}
    if not any(row.model_dump(exclude_none=True) for row in rows.values()):
        return None
    flanks = {}
    units = table.units
    columns = {"O_x": units.O, "O_y": units.O, "r": units.r}
    for name, areas in (("1 to 5", range(1, 6)), ("10 to 6", range(10, 5, -1))):
        lacking = {(area, key) for area in areas for key in columns if getattr(rows[area], key) is None}
        if not lacking:
            flanks[name] = np.array(
                [[_in_metres(getattr(rows[area], key), unit) for key, unit in columns.items()] for area in areas]
            )
        elif (name == "10 to 6" and not flanks) or len(lacking) < 15:
            area, key = min(lacking)
            raise InputError(
                f"table1.areas.{area}.{key} = null beside cells that are filled in: give O_x, O_y and r of "
                "areas 1 to 5, of areas 6 to 10 or of all; u_x, u_y and theta may stay null"
            )
    if "10 to 6" in flanks:
        flanks["10 to 6"][:, 0] *= -1
    if len(flanks) == 2:
        apart = np.abs(flanks["1 to 5"] - flanks["10 to 6"])
        if apart.max() > rounding(np.concatenate([*flanks.values()])):
            j, k = np.unravel_index(apart.argmax(), apart.shape)
            raise InputError(
                f"table1.areas.{10 - j}.{('O_x', 'O_y', 'r')[k]} = {rows[10 - j].model_dump()[('O_x', 'O_y', 'r')[k]]}"
                f" is not the mirror image of that of area {1 + j}, by {1e3 * apart.max():.3g} mm; areas 10 to 6 "
                "mirror areas 1 to 5"
            )
    return np.column_stack([next(iter(flanks.values())), SIGNS]).tolist()


def _in_metres(value: float, unit: str) -> float:
    """A length in m with the decimals that it is printed with."""
    return float(Decimal(repr(float(value))).scaleb({"m": 0, "mm": -3}[unit]))


def _refuse_halves(tables: PaperTables) -> None:
    two = tables.table2
    if (two.proposed is None) != (two.recurdyn is None):
        lacking = "proposed" if two.proposed is None else "recurdyn"
        raise InputError(f"table2.{lacking} = null without the other time: give both times of a row, or none")
    for name, other in (AXIAL, AXIAL[::-1]):
        if value_of(tables, name) is not None and value_of(tables, other) is None:
            raise InputError(
                f"parameters.{other} = null but {name} is given: give both lengths, whose mean is L of Eq. 19, or none"
            )
    if value_of(tables, "r_a") is not None and table1_arcs(tables.table1) is None:
        raise InputError(
            "parameters.r_a is given without Table 1: the groove follows from Table 1, whose tips it is "
            "compared with; fill in Table 1, or use null"
        )
    for name in OWN:
        entry = tables.parameters.get(name)
        if entry is None or entry.value is None:
            continue
        if entry.unit != "m" or isinstance(entry.value, str) or not 0 < entry.value <= LONGEST_M:
            raise InputError(
                f"parameters.{name} = {shown(entry.value)} {entry.unit}: must be a number between 0 and {LONGEST_M:g} m"
            )


def value_of(tables: PaperTables, name: str) -> Any:
    """Value of an entry of ``parameters``; None if it is missing."""
    entry = tables.parameters.get(name)
    return None if entry is None else entry.value
