from trackdyn.sweeps.job import logged

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import write_captioned_table

with logged(snakemake):
    table = pd.read_csv(snakemake.input[-1])
    moved = f"{(~table['stable']).sum()} of {len(table)} changes exceed their tolerance."
    write_captioned_table(table, snakemake.output.csv, f"{caption('stability')} {moved}")
