import pandas as pd
from _script import logged

from trackdyn.files import write_csv
from replication.study.layouts import layouts

with logged(snakemake):
    numbers = range(int(snakemake.wildcards.first), int(snakemake.wildcards.last))
    write_csv(snakemake.output[0], pd.DataFrame(list(layouts(numbers))))
