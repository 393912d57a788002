"""The table of the stability of the statistics."""

from trackdyn.sweeps.job import run_job

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import write_captioned_table


def main(job) -> None:
    """Rule `stability`."""
    table = pd.read_csv(job.input.runs)
    moved = f"{(~table['stable']).sum()} of {len(table)} changes exceed their tolerance."
    write_captioned_table(table, job.output.csv, f"{caption('stability')} {moved}")


if __name__ == "__main__":
    run_job(main)
