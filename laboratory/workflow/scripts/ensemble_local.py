from trackdyn.sweeps.job import logged

from pathlib import Path

from laboratory.inference.ensemble.local import local_ends, local_points
from laboratory.inference.ensemble.stages import open_ensemble
from laboratory.inference.search import ends_table, straight
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    given, made = snakemake.input, snakemake.output
    ensemble = open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, Path(made.points).parent)
    ends = local_ends(ensemble, snakemake.threads, snakemake.params.store)
    cutoff = ensemble.config.cutoff
    excluded_by = [sum(abs(straight(one)) > cutoff for one in end.residuals) for end in ends]
    table = ends_table(ends).assign(excluded_by=excluded_by)
    write_table(table, made.ends)
    write_table(local_points(ensemble, ends), made.points)
    print(table.to_string(index=False))
