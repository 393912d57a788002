import pandas as pd
from _script import logged

from trackdyn import Scene, load_rig
from trackdyn.measure.stopping import StopRule
from replication.paper.contents import caption
from replication.report.tables import write_table
from replication.study.stability import stability

with logged(snakemake):
    rig, rule = load_rig(snakemake.input.rig), StopRule(**snakemake.params.known)
    tables = [
        stability(Scene(rig, **fields | {"pitches": tuple(fields["pitches"])}), rule)
        for fields in snakemake.params.scenes
    ]
    table = pd.concat(tables, ignore_index=True)
    moved = int((~table["stable"]).sum())
    write_table(
        table,
        snakemake.output.csv,
        f"{caption('stability')} {moved} of {len(table)} changes exceed their tolerance.",
    )
