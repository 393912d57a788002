from trackdyn.sweeps.job import logged

from pathlib import Path

from laboratory.inference.ensemble.conflicts import conflicts
from laboratory.inference.ensemble.stages import open_ensemble
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    given, made = snakemake.input, snakemake.output
    ensemble = open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, Path(made.points).parent)
    table, points = conflicts(ensemble, snakemake.threads, snakemake.params.store)
    write_table(points, made.points)
    write_table(table, made.conflicts)
    print(table.to_string(index=False))
