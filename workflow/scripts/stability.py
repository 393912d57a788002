import pandas as pd
from _script import logged

from trackdyn import Scene, load_rig
from trackdyn.paper.contents import caption
from trackdyn.report.tables import write_table
from trackdyn.study.stability import stability

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    tables = []
    for fields in snakemake.params.scenes:
        tables.append(stability(Scene(rig, **(fields | {"pitches": tuple(fields["pitches"])}))))
    table = pd.concat(tables, ignore_index=True)
    moved = int((~table["stable"]).sum())
    write_table(
        table,
        snakemake.output.csv,
        f"{caption('stability')} {moved} of {len(table)} changes exceed their tolerance.",
    )
