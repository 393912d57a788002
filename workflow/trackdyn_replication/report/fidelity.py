"""The table of the ladder of fidelities."""

from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn_replication.study.accuracy.ladder import compare_rungs


def ladder_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Pivot the ladder's long table to one row a scene and setting, in its order."""
    key = ["scene", "setting"]
    columns = ["rms", "sd", "line", "high_frequency", "left_share", "right_share", "ring_share", "left_peak"]
    wide = rows.pivot(index=key, columns="measure", values="difference_pct")[columns]
    gap = rows[rows["measure"] == "loop_gap"].set_index(key)["value"]
    cost = rows.groupby(key, sort=False)["wall_s_per_s"].first()
    return wide.join(gap.rename("loop_gap_m")).join(cost).loc[cost.index].reset_index()


@run_job
def main(job) -> None:
    """Rule `fidelity`."""
    rows = compare_rungs(pd.concat(map(pd.read_csv, job.input.settings), ignore_index=True))
    write_csv(job.output.csv, rows)
    write_csv(job.output.wide, ladder_table(rows))
