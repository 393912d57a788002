from trackdyn.sweeps.job import logged

from replication.paper.contents import caption
from replication.report.tables import cost_table, headed, write_captioned_table

with logged(snakemake):
    table = cost_table(snakemake.params.folder)
    write_captioned_table(table, snakemake.output.csv, caption("costs"), shown=headed(table, "costs"))
