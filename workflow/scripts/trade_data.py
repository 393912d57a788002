import pandas as pd

from trackdyn.sweeps.job import logged
from trackdyn.files import write_csv

with logged(snakemake):
    for name, path in snakemake.output.items():
        tables = [pd.read_csv(part) for part in snakemake.input[name]]
        joined = pd.concat([table for table in tables if len(table)], ignore_index=True)
        write_csv(path, joined)
