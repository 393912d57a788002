from trackdyn.sweeps.job import logged

from pathlib import Path

from replication.certify.crate import write_crate

with logged(snakemake):
    print(write_crate(Path(snakemake.input.manifest).parent, snakemake.output[0]))
