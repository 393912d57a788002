"""Figures 23 and 24 of the replication, with what the paper prints of them."""

from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd

from replication.paper import printed
from trackdyn.plots.ring_study import figures
from trackdyn.plots.style import save

MARKS = {
    "printed: the right arc lets go": printed.RADIUS_WITHOUT_RIGHT_CONTACT,
    "printed: recommended": printed.RADIUS_CHOSEN,
}
STEADY = printed.STEADY_LEFT_SHARE, printed.RADIUS_OF_STEADY_LEFT_SHARE


@run_job
def main(job) -> None:
    """Rule `ring_figures`."""
    for name, figure in figures(pd.read_csv(job.input.metrics), MARKS, STEADY).items():
        save(figure, job.output[name][0])
