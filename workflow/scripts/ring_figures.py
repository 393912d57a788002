from trackdyn.sweeps.job import logged

import pandas as pd

from replication.report.figures.ring_study import duration_figure, force_figure
from trackdyn.plots.style import save

with logged(snakemake):
    metrics = pd.read_csv(snakemake.input.metrics)
    study = metrics[metrics["run"].str.startswith("ring/")]
    save(force_figure(study, "rms"), snakemake.output.rms[0])
    save(force_figure(study, "sd"), snakemake.output.sd[0])
    save(duration_figure(study), snakemake.output.duration[0])
