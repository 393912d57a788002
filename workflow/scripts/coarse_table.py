from trackdyn.sweeps.job import logged

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import headed, table4, write_captioned_table

with logged(snakemake):
    table = table4(pd.read_csv(snakemake.input.metrics), snakemake.params.speeds)
    write_captioned_table(table, snakemake.output.csv, caption("table4"), shown=headed(table, "table4"))
