from pathlib import Path

import pandas as pd
from _script import logged

with logged(snakemake):
    for name, path in snakemake.output.items():
        tables = [pd.read_csv(part) for part in snakemake.input[name]]
        joined = pd.concat([table for table in tables if len(table)], ignore_index=True)
        Path(path).write_text(joined.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
