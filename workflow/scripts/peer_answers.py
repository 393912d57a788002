from trackdyn.sweeps.job import logged

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import answers_outcome, headed, write_captioned_table

with logged(snakemake):
    table = pd.read_csv(snakemake.input[-1])
    text = f"{caption('peer_answers')}\n\n{answers_outcome(table, snakemake.params.tolerance)}"
    write_captioned_table(table, snakemake.output.csv, text, shown=headed(table, "peer_answers"))
