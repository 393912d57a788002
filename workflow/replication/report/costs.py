"""What each rule cost."""

from trackdyn.sweeps.job import run_job

from pathlib import Path

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import headed, write_captioned_table
from replication.studies import BY_NAME


def cost_table(folder: Path | str) -> pd.DataFrame:
    """What every rule cost, from what each job wrote into a folder: ``rule, jobs, wall_s, cpu_s, largest_memory_mb``.

    Jobs of a kind share a row, the dearest stand first. Their total follows, and then what is asked for by name.
    """
    folder, rows = Path(folder), []
    for path in sorted(folder.rglob("*.tsv")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        row = pd.read_csv(path, sep="\t").iloc[-1]
        # one line for all runs of a kind: simulate/ring/..., simulate/meshing/..., simulate records
        kind = name.rpartition("/")[0]
        kind = name if kind in ("", "short") else kind  # short forms of the studies stand in a folder
        rows.append({"rule": kind, "wall_s": row["s"], "cpu_s": row["cpu_time"], "memory_mb": row["max_rss"]})
    if not rows:
        return pd.DataFrame(columns=["rule", "jobs", "wall_s", "cpu_s", "largest_memory_mb"])
    table = pd.DataFrame(rows).groupby("rule", as_index=False)
    sums = {"jobs": ("wall_s", "size"), "wall_s": ("wall_s", "sum"), "cpu_s": ("cpu_s", "sum")}
    table = table.agg(**sums, largest_memory_mb=("memory_mb", "max")).sort_values("wall_s", ascending=False)
    named = table["rule"].str.partition("/")[0].isin(BY_NAME)
    run, by_name = table[~named], table[named]
    total = run.agg({"jobs": "sum", "wall_s": "sum", "cpu_s": "sum", "largest_memory_mb": "max"})
    total = pd.DataFrame([{"rule": "all of a run"} | total.to_dict()]).astype({"jobs": int})
    return pd.concat([run, total, by_name.assign(rule=by_name["rule"] + ", by name")], ignore_index=True)


def main(job) -> None:
    """Rule `costs`."""
    table = cost_table(job.params.folder)
    write_captioned_table(table, job.output.csv, caption("costs"), shown=headed(table, "costs"))


if __name__ == "__main__":
    run_job(main)
