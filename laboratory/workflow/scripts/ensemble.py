from trackdyn.sweeps.job import logged

from pathlib import Path

import pandas as pd

from laboratory.inference.ensemble.stages import open_ensemble
from laboratory.report.ensemble import write_figures, write_tables

with logged(snakemake):
    given = snakemake.input
    folder = Path(snakemake.output.rigs).parent
    ensemble = open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, folder)
    print(write_tables(ensemble, given.claims, pd.read_csv(given.card)))
    write_figures(ensemble, pd.read_csv(given.metrics))
