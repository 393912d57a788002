"""Jobs of a sweep in batches (`workflow/sweep.smk`)."""

from trackdyn.sweeps.snakemake_job import run_job

from trackdyn.errors import TrackdynError
from trackdyn.files import write_text
from trackdyn.jit import cache_folder
from trackdyn.sweeps.design import read_table, write_table
from trackdyn.sweeps.engine import FAILED
from trackdyn.sweeps.sweep import batches, one_of_each_kind, states_summary, sweep


def split(job) -> None:
    """Write the rows of every batch."""
    parts = batches(job.input.design, job.params.rig, len(job.output))
    for path, rows in zip(job.output, parts, strict=True):
        write_table(rows, path)
        print(path, len(rows))


def warm_up(job) -> None:
    """Compile the kernels with a row of every kind."""
    rows = one_of_each_kind(job.input.design)
    print(sweep(rows, rig=job.input.rig, jobs=1, store=job.params.store)[["state", "reason"]])
    write_text(job.output[0], f"{cache_folder().name}\n")


def batch(job) -> None:
    """Compute the rows of a batch. Raises `TrackdynError` for Snakemake to try again: some failed for now."""
    results = read_table(job.input.design)
    if len(results):  # there may be more batches than rows
        results = sweep(results, rig=job.input.rig, jobs=job.threads, store=job.params.store)
        print(states_summary(results))
        failed = results.loc[results["state"] == FAILED, "reason"]
        if len(failed) and job.resources.attempt < job.params.tries:
            raise TrackdynError(
                f"{len(failed)} rows are to be tried again, by --retries or taken so by tries=1: {failed.iloc[0]}"
            )
    write_table(results, job.output[0])


def gather(job) -> None:
    """Write all rows in the order of the design."""
    results = sweep(job.input.design, job.output[0], job.input.rig, job.threads, job.params.store)
    print(states_summary(results))


TASKS = {"split": split, "warm_up": warm_up, "batch": batch, "gather": gather}


@run_job
def main(job) -> None:
    """Rules of `workflow/sweep.smk`."""
    TASKS[job.params.task](job)
