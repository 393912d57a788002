from trackdyn.sweeps.job import logged

from trackdyn.sweeps.sweep import states_summary, sweep

with logged(snakemake):
    given = snakemake.input
    results = sweep(given.design, snakemake.output[0], given.rig, snakemake.threads, snakemake.params.store)
    print(states_summary(results))
