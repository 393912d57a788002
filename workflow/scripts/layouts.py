from trackdyn.sweeps.job import logged

import pandas as pd

from replication.report.tables import write_captioned_table
from replication.study.layouts import layouts_outcome, layouts_summary
from trackdyn.files import write_csv

with logged(snakemake):
    table = pd.concat([pd.read_csv(path, keep_default_na=True) for path in snakemake.input.parts], ignore_index=True)
    write_csv(snakemake.output.csv, table)
    write_captioned_table(layouts_summary(table), snakemake.output.summary, layouts_outcome(table))
