"""Measures that compare with the article's cells that a reader filled in."""

import numpy as np

from replication.paper.evidence import Evidence, NotThere
from replication.paper.measures import coarse_rms_difference, measure, register_all
from replication.paper.paper_tables import value_difference


def _cells(e: Evidence, name: str, speeds) -> np.ndarray:
    statistics = {} if e.tables is None else e.tables.statistics(name)
    table, column = ("Table 4", "rms") if name == "coarse_rms" else ("Table 3", name)
    if missing := [f"{rpm:g}" for rpm in speeds if rpm not in statistics]:
        raise NotThere(f"{table} is not filled in: {column} at {', '.join(missing)} rpm")
    return np.array([statistics[rpm] for rpm in speeds])


def _against(what, e, speeds):
    """Difference of a column of our records from a column of Table 3, % of the latter."""
    ours, cells = what
    return value_difference(e.records(speeds)[ours], _cells(e, cells, speeds)).tolist()


register_all(
    _against, "records", by_speed=True,
    rms_against_experiment=("rms_g", "rms_experiment"), sd_against_experiment=("sd_g", "sd_experiment"),
    rms_against_simulation=("rms_g", "rms_simulation"), sd_against_simulation=("sd_g", "sd_simulation"),
)  # fmt: skip


@measure("records", by_speed=True)
def coarse_less_accurate(e, speeds):
    """How much farther from the article's measured RMS three surfaces are than ten arcs, points."""
    measured, fine = _cells(e, "rms_experiment", speeds), e.records(speeds)["rms_g"].to_numpy()
    coarse = fine * (1 + np.array(coarse_rms_difference(e, speeds)) / 100)
    return (value_difference(coarse, measured) - value_difference(fine, measured)).tolist()


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
