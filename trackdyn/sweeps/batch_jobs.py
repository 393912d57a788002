"""Jobs of a sweep in batches (`workflow/sweep.smk`)."""

from trackdyn.sweeps.snakemake_job import run_job

from trackdyn.inputs.errors import TrackdynError
from trackdyn.sweeps.engine import FAILED
from trackdyn.sweeps.sweep import batches, states_summary, sweep


@run_job
def main(job) -> None:
    """Compute the rows of a batch, or all of them (rules `batch` and `gather`).

    Raises `TrackdynError` so that Snakemake repeats the job: rows of a batch failed, and attempts remain.
    """
    batch, design = job.params.get("batch"), job.input.design
    if batch is not None:
        design = batches(design, job.input.rig, job.params.batches)[batch]
    results = sweep(design, job.output[0], job.input.rig, job.threads, job.params.store)
    print(states_summary(results))
    failed = results.loc[results["state"] == FAILED, "reason"]
    if batch is not None and len(failed) and job.resources.attempt <= job.params.retries:
        raise TrackdynError(f"{len(failed)} rows will be tried again: {failed.iloc[0]}")
