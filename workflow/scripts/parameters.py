from trackdyn.sweeps.job import logged

from replication.paper.contents import caption
from replication.report.tables import table1, write_captioned_table
from trackdyn import load_rig
from trackdyn.parameters.table import parameter_table

with logged(snakemake):
    table = parameter_table(snakemake.input.rig)
    write_captioned_table(table, snakemake.output.csv, caption("parameters"), digits=9)  # as they were given
    write_captioned_table(
        table1(load_rig(snakemake.input.rig).groove_profile), snakemake.output.groove, caption("table1"), digits=4
    )
    print(table["kind"].value_counts())
