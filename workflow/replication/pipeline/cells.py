"""Write what a reader filled in of the rig."""

from trackdyn.sweeps.job import run_job

import pandas as pd

from trackdyn.files import write_csv


def main(job) -> None:
    """Rule `cells`."""
    write_csv(job.output[0], pd.DataFrame(job.params.cells))


if __name__ == "__main__":
    run_job(main)
