from trackdyn.sweeps.job import logged

from pathlib import Path

from laboratory.inference.ensemble.stages import gather_stage, open_ensemble

with logged(snakemake):
    given = snakemake.input
    folder = Path(snakemake.output[0]).parent
    gather_stage(
        open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, folder), snakemake.wildcards.stage
    )
