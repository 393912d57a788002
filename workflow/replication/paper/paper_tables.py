"""The cells of the article that our text of it lacks (``config/rigs/paper/tables.yaml``), as a reader fills them in.

Every cell may be null. Tables 2 to 4 concern claims; what the others say of a rig becomes one (`printed_rig`).
"""

from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field

from replication.paper import printed
from trackdyn.errors import InputError
from trackdyn.rig.validation import Section, plain_number, validated
from trackdyn.rig.yaml_file import read_yaml

# points by which printed cells may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1
G = 9.81  # m/s2, as the article takes it (Eq. 40)


def _or_null(cell: Any) -> Any:
    return None if cell is None else plain_number(cell)


def _or_word(cell: Any) -> Any:
    return cell if isinstance(cell, str) else _or_null(cell)


Number = Annotated[float | None, BeforeValidator(_or_null)]
Above = Annotated[Annotated[float, Field(gt=0)] | None, BeforeValidator(_or_null)]
Word = Annotated[float | str | None, BeforeValidator(_or_word)]
Row = TypeVar("Row", bound=Section)


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
    """Computing times, both or none."""

    place: str
    unit: Literal["s"]
    proposed: Above = None
    recurdyn: Above = None

    def model_post_init(self, context: Any) -> None:
        """Refuse one time without the other."""
        for name, other in (("proposed", self.recurdyn), ("recurdyn", self.proposed)):
            if getattr(self, name) is None and other is not None:
                raise InputError(f"table2.{name} = null without the other time: give both times of a row, or none")


class Statistics(Section):
    """A row of Table 3."""

    rms_simulation: Above = None
    rms_experiment: Above = None
    sd_simulation: Above = None
    sd_experiment: Above = None


class Coarse(Section):
    """A row of Table 4: RMS with a coarser tooth contact."""

    rms: Above = None


class BySpeed(Section, Generic[Row]):
    """Accelerations by motor speed, rev/min."""

    place: str
    unit: Literal["g", "m/s2"]
    speeds: dict[Annotated[int, Field(gt=0)], Row]


class Parameter(Section):
    """A number outside the tables, under the name of a rig's field or one of `printed_rig.OWN`."""

    value: Word = None
    unit: str
    name: str
    place: str


class PaperTables(Section):
    """``config/rigs/paper/tables.yaml``: the cells of Tables 1 to 4, and parameters."""

    table1: Table1
    table2: Table2
    table3: BySpeed[Statistics]
    table4: BySpeed[Coarse]
    parameters: dict[str, Parameter]

    def statistics(self, name: str) -> dict[int, float]:
        """Filled cells of a column of Table 3 or, as ``coarse_rms``, of Table 4 by motor speed (rev/min), g."""
        table, column = (self.table4, "rms") if name == "coarse_rms" else (self.table3, name)
        scale = 1.0 if table.unit == "g" else 1 / G
        cells = {rpm: getattr(row, column) for rpm, row in table.speeds.items()}
        return {rpm: scale * value for rpm, value in cells.items() if value is not None}

    def value(self, name: str) -> Any:
        """Value of an entry of ``parameters``; None if it is missing."""
        return self.parameters[name].value if name in self.parameters else None


def load_article(path: Path | str) -> PaperTables:
    """Read the cells, compared with the differences that the text prints.

    Raises `InputError`: what is half filled, contradicts itself or the text, in one sentence.
    """
    tables = validated(PaperTables, read_yaml(path), str(path), "leave the cell at null if the article has none")
    for name, text in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
        simulated, measured = (tables.statistics(f"{name}_{source}") for source in ("simulation", "experiment"))
        for rpm in sorted(simulated.keys() & measured.keys() & text.keys()):
            difference = value_difference(simulated[rpm], measured[rpm])
            if abs(difference - text[rpm]) > ROUNDED_DIFFERENCE:
                raise InputError(
                    f"{path}: table3.speeds.{rpm}.{name}_simulation = {simulated[rpm]:.6g} g and {name}_experiment = "
                    f"{measured[rpm]:.6g} g differ by {difference:.3g} % where the text prints {text[rpm]:g} %; "
                    "cells that differ as printed are accepted"
                )
    return tables


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured
