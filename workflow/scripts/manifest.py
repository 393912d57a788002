from trackdyn.sweeps.job import logged

from pathlib import Path

from replication.certify.manifest import write_manifest

with logged(snakemake):
    print(write_manifest(Path(snakemake.output[0]).parent, snakemake.params.inputs))
