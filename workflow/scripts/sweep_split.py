from trackdyn.sweeps.job import logged

from trackdyn.sweeps.sweep import batches
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    for path, part in zip(
        snakemake.output, batches(snakemake.input.design, snakemake.params.rig, len(snakemake.output)), strict=True
    ):
        write_table(part, path)
        print(path, len(part))
