from _script import logged

from trackdyn.errors import TrackdynError
from trackdyn.sweeps.row import FAILED
from trackdyn.sweeps.sweep import summary, sweep
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    results = sweep(
        snakemake.input.design, rig=snakemake.input.rig, jobs=snakemake.threads, store=snakemake.params.store
    )
    print(summary(results))
    failed = results.loc[results["state"] == FAILED, "reason"]
    if len(failed) and snakemake.resources.attempt < snakemake.params.tries:
        raise TrackdynError(
            f"{len(failed)} rows are to be tried again, by --retries or taken so by tries=1: {failed.iloc[0]}"
        )
    write_table(results, snakemake.output[0])
