from trackdyn.sweeps.job import logged

import pandas as pd

from trackdyn.files import write_csv

with logged(snakemake):
    write_csv(snakemake.output[0], pd.DataFrame(snakemake.params.cells))
