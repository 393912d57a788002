from _script import logged

from trackdyn.sweeps.sweep import summary, sweep

with logged(snakemake):
    print(
        summary(
            sweep(
                snakemake.input.design, snakemake.output[0], snakemake.input.rig, jobs=1, store=snakemake.params.store
            )
        )
    )
