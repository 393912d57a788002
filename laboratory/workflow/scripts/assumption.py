from _script import logged

from laboratory.inference.assumptions import run_named

with logged(snakemake):
    given, params = snakemake.input, snakemake.params
    run_named(
        given.rig, given.config, given.fit, params.form, snakemake.wildcards.assumption, params.store,
        snakemake.output[0],
    )  # fmt: skip
