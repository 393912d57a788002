from _script import logged

from trackdyn import load_rig
from trackdyn.parameters.rig import parameter_table
from trackdyn.report.tables import TABLE1_CAPTION, table1, write_table

with logged(snakemake):
    table = parameter_table(snakemake.input.rig)
    write_table(table, snakemake.output.csv, "Every parameter of the rig with its kind and source.")
    write_table(table1(load_rig(snakemake.input.rig).groove_profile), snakemake.output.groove, TABLE1_CAPTION)
    print(table["kind"].value_counts())
