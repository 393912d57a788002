"""The article in somebody's hand: cells that a reader filled in."""

from pathlib import Path

import numpy as np

from replication.paper import printed
from trackdyn.errors import InputError
from trackdyn.parameters.paper_tables import PaperTables, load_paper_tables

# points by which printed cells may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1


def load_article(path: Path | str) -> PaperTables:
    """The cells that a reader filled in, held against the differences that the text prints."""
    tables = load_paper_tables(path)
    for name, text in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
        simulated, measured = (tables.statistics(f"{name}_{source}") for source in ("simulation", "experiment"))
        for rpm in sorted(simulated.keys() & measured.keys() & text.value.keys()):
            found = value_difference(simulated[rpm], measured[rpm])
            if abs(found - text.value[rpm]) > ROUNDED_DIFFERENCE:
                raise InputError(
                    f"{path}: table3.speeds.{rpm}.{name}_simulation = {simulated[rpm]:.6g} g and {name}_experiment = "
                    f"{measured[rpm]:.6g} g differ by {found:.3g} % where the text prints {text.value[rpm]:g} %; cells "
                    "that differ as printed are accepted"
                )
    return tables


def value_difference(simulated, measured):
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(np.asarray(simulated) - measured) / measured
