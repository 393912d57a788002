from trackdyn.sweeps.job import logged

import pandas as pd

from replication.study.layouts import layouts
from trackdyn.files import write_csv

with logged(snakemake):
    numbers = range(int(snakemake.wildcards.first), int(snakemake.wildcards.last))
    write_csv(snakemake.output[0], pd.DataFrame(list(layouts(numbers))))
