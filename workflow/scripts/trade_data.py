from trackdyn.sweeps.job import logged

import pandas as pd

from trackdyn.files import write_csv

with logged(snakemake):
    for name, path in snakemake.output.items():
        tables = [pd.read_csv(part) for part in snakemake.input[name]]
        full = [table for table in tables if len(table)]  # those without rows have no types
        write_csv(path, pd.concat(full, ignore_index=True) if full else tables[0])
