from trackdyn.sweeps.job import logged

import pandas as pd

from replication.study.stability import stability
from trackdyn import Scene, load_rig
from trackdyn.files import write_csv
from trackdyn.scene.stop_rule import StopRule

with logged(snakemake):
    rig, rule = load_rig(snakemake.input.rig), StopRule(**snakemake.params.known)
    scenes = (Scene(rig, **fields | {"pitches": tuple(fields["pitches"])}) for fields in snakemake.params.scenes)
    write_csv(snakemake.output[0], pd.concat([stability(scene, rule) for scene in scenes], ignore_index=True))
