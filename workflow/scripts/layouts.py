import pandas as pd
from _script import logged

from trackdyn.files import write_csv
from replication.report.tables import write_table
from replication.study.layouts import layouts_summary, outcome

with logged(snakemake):
    table = pd.concat([pd.read_csv(path, keep_default_na=True) for path in snakemake.input.parts], ignore_index=True)
    write_csv(snakemake.output.csv, table)
    write_table(layouts_summary(table), snakemake.output.summary, outcome(table))
