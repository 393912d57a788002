from _script import logged

from trackdyn.paper.contents import caption
from trackdyn.report.tables import cost_table, headed, write_table

with logged(snakemake):
    table = cost_table(snakemake.params.folder)
    write_table(table, snakemake.output.csv, caption("costs"), shown=headed(table, "costs"))
