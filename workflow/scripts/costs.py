from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn.paper.contents import caption
from trackdyn.report.tables import write_table

with logged(snakemake):
    folder = Path(snakemake.params.folder)
    rows = []
    for path in sorted(folder.rglob("*.tsv")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        row = pd.read_csv(path, sep="\t").iloc[-1]
        # one line for all runs of a kind: simulate/ring/..., simulate/meshing/..., simulate records
        kind = "/".join(name.split("/")[:-1]) or name
        rows.append({"rule": kind, "wall_s": row["s"], "cpu_s": row["cpu_time"], "memory_mb": row["max_rss"]})
    table = pd.DataFrame(rows).apply(lambda c: pd.to_numeric(c, errors="coerce") if c.name != "rule" else c)
    table = table.groupby("rule").agg(
        jobs=("wall_s", "size"),
        wall_s=("wall_s", "sum"),
        cpu_s=("cpu_s", "sum"),
        largest_memory_mb=("memory_mb", "max"),
    )
    write_table(table.reset_index(), snakemake.output.csv, caption("costs"))
