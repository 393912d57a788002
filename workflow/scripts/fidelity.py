from trackdyn.sweeps.job import logged

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import headed, ladder_table, write_captioned_table
from replication.study.accuracy.ladder import compare_rungs
from trackdyn.files import write_csv

with logged(snakemake):
    found = [pd.read_csv(path) for path in snakemake.input.settings]
    rows = compare_rungs(pd.concat(found, ignore_index=True))
    write_csv(snakemake.output.csv, rows)
    table = ladder_table(rows)
    write_captioned_table(table, snakemake.output.wide, caption("fidelity"), shown=headed(table, "fidelity"))
