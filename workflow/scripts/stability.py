import pandas as pd

from trackdyn.sweeps.job import logged
from replication.paper.contents import caption
from replication.report.tables import write_table
from replication.study.stability import stability
from trackdyn import Scene, load_rig
from trackdyn.scene.stop_rule import StopRule

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
