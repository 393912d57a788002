from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import caption
from trackdyn.replacing import write_csv
from trackdyn.report.tables import headed, ladder_table, write_table
from trackdyn.study.accuracy.ladder import compare_rungs

with logged(snakemake):
    study = snakemake.params.study
    radii = ([None] if study["without_ring"] else []) + [snakemake.params.radius]
    rows = compare_rungs(load_rig(snakemake.input.rig), study["speeds_rpm"], radii, study["loop_turns"])
    write_csv(snakemake.output.csv, rows)
    table = ladder_table(rows)
    write_table(table, snakemake.output.wide, caption("fidelity"), shown=headed(table, "fidelity"))
