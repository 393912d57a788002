import pandas as pd
from _script import logged

from trackdyn.sweeps.table import write_table

with logged(snakemake):
    write_table(pd.DataFrame(snakemake.params.rows), snakemake.output[0])
