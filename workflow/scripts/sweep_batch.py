from trackdyn.sweeps.job import logged

from trackdyn.errors import TrackdynError
from trackdyn.sweeps.store import FAILED
from trackdyn.sweeps.sweep import states_summary, sweep
from trackdyn.sweeps.table import read_table, write_table

with logged(snakemake):
    results = read_table(snakemake.input.design)
    if len(results):  # there may be more batches than rows
        results = sweep(results, rig=snakemake.input.rig, jobs=snakemake.threads, store=snakemake.params.store)
        print(states_summary(results))
        failed = results.loc[results["state"] == FAILED, "reason"]
        if len(failed) and snakemake.resources.attempt < snakemake.params.tries:
            raise TrackdynError(
                f"{len(failed)} rows are to be tried again, by --retries or taken so by tries=1: {failed.iloc[0]}"
            )
    write_table(results, snakemake.output[0])
