"""The article in somebody's hand: cells that a reader filled in, and the measures that compare with them."""

from pathlib import Path

import numpy as np

from replication.paper import printed
from replication.paper.evidence import Evidence, NotThere
from replication.paper.measures import alike, coarse_rms_difference, measure
from trackdyn.errors import InputError
from trackdyn.parameters.paper_tables import PaperTables, load_paper_tables

# points by which printed cells may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1


def load_article(path: Path | str) -> PaperTables:
    """The cells that a reader filled in, held against the differences that the text prints.

    Raises
    ------
    InputError
        One sentence with file, field, value and what is accepted.
    """
    tables = load_paper_tables(path)
    for name, text in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
        simulated, measured = (tables.statistics(f"{name}_{source}") for source in ("simulation", "experiment"))
        for rpm in sorted(simulated.keys() & measured.keys() & text.value.keys()):
            found = _difference(simulated[rpm], measured[rpm])
            if abs(found - text.value[rpm]) > ROUNDED_DIFFERENCE:
                raise InputError(
                    f"{path}: table3.speeds.{rpm}.{name}_simulation = {simulated[rpm]:.6g} g and {name}_experiment = "
                    f"{measured[rpm]:.6g} g differ by {found:.3g} % where the text prints {text.value[rpm]:g} %; cells "
                    "that differ as printed are accepted"
                )
    return tables


def _difference(simulated, measured):
    """The article's value difference, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured


def _cells(e: Evidence, name: str, speeds) -> np.ndarray:
    found = {} if e.tables is None else e.tables.statistics(name)
    table, column = ("Table 4", "rms") if name == "coarse_rms" else ("Table 3", name)
    if missing := [f"{rpm:g}" for rpm in speeds if rpm not in found]:
        raise NotThere(f"{table} is not filled in: {column} at {', '.join(missing)} rpm")
    return np.array([found[rpm] for rpm in speeds])


def _against(what, e, speeds):
    """Difference of a column of our records from a column of Table 3, % of the latter."""
    ours, cells = what
    return _difference(e.records(speeds)[ours], _cells(e, cells, speeds)).tolist()


alike(
    _against, "records", by_speed=True,
    rms_against_experiment=("rms_g", "rms_experiment"), sd_against_experiment=("sd_g", "sd_experiment"),
    rms_against_simulation=("rms_g", "rms_simulation"), sd_against_simulation=("sd_g", "sd_simulation"),
)  # fmt: skip


@measure("records", by_speed=True)
def coarse_less_accurate(e, speeds):
    """How much farther from the article's measured RMS three surfaces are than ten arcs, points."""
    measured, fine = _cells(e, "rms_experiment", speeds), e.records(speeds)["rms_g"].to_numpy()
    coarse = fine * (1 + np.array(coarse_rms_difference(e, speeds)) / 100)
    return (_difference(coarse, measured) - _difference(fine, measured)).tolist()


@measure("records", by_speed=True)
def coarse_change_over_printed(e, speeds):
    """Change of the RMS by three surfaces less that by the algorithm of Ref. [2] in the article, points."""
    change = 100 * (_cells(e, "coarse_rms", speeds) / _cells(e, "rms_simulation", speeds) - 1)
    return (np.array(coarse_rms_difference(e, speeds)) - change).tolist()


@measure("peer")
def speed_over_printed(e, speeds):
    """CPU time of the independent code over ours at equal accuracy, over Recurdyn's over the article's."""
    times = None if e.tables is None else e.tables.table2
    if times is None or times.proposed is None or times.recurdyn is None:
        raise NotThere("Table 2 is not filled in")
    chosen = e.costs[e.costs["chosen"] == "yes"].set_index("code")["cpu_s_per_s"] if "chosen" in e.costs else {}
    if not {"trackdyn", "exudyn"} <= set(getattr(chosen, "index", ())):
        raise NotThere("not run")
    return float(chosen["exudyn"] / chosen["trackdyn"] * times.proposed / times.recurdyn)
