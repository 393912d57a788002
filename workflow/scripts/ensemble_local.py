from pathlib import Path

from _script import logged

from trackdyn.inference.ensemble.local import local_ends, local_points
from trackdyn.inference.ensemble.stages import open_ensemble
from trackdyn.inference.search import ends_table
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    given, made = snakemake.input, snakemake.output
    ensemble = open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, Path(made.points).parent)
    ends = local_ends(ensemble, snakemake.threads, snakemake.params.store)
    write_table(ends_table(ends), made.ends)
    write_table(local_points(ensemble, ends), made.points)
    print(ends_table(ends).to_string(index=False))
