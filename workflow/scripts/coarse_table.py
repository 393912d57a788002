import pandas as pd
from _script import logged

from trackdyn.report.tables import table4, write_table

with logged(snakemake):
    write_table(
        table4(pd.read_csv(snakemake.input.metrics), snakemake.params.speeds),
        snakemake.output.csv,
        "Table 4. RMS and SD with a tooth of three surfaces (left, seat, right; of the kind in Ref. [2]) beside the ten "
        "arcs. The paper's cells are lost, and its measured data are not public, so neither can be called more accurate here.",
    )
