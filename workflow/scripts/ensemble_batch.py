import pandas as pd
from _script import logged

from trackdyn.ensemble.stages import open_ensemble, part, run_stage
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    given, params, names = snakemake.input, snakemake.params, snakemake.wildcards
    ensemble = open_ensemble(given.config, params.form, given.rig, given.claims, params.folder)
    points = part(pd.read_csv(given.points), int(names.batch), params.batches)
    runs = run_stage(ensemble, names.stage, points, params.store, jobs=snakemake.threads)
    write_table(runs, snakemake.output[0])
    print(runs["state"].value_counts().to_string())
