import json
import sys
from pathlib import Path

from trackdyn.sweeps.job import logged
from trackdyn import Scene, load_rig, simulate

with logged(snakemake):
    fields = snakemake.params.scene | {"pitches": tuple(snakemake.params.scene["pitches"])}
    if snakemake.input.plan:
        fields |= json.loads(Path(snakemake.input.plan).read_text(encoding="utf-8"))[snakemake.wildcards.run]
    scene = Scene(load_rig(snakemake.input.rig), **fields)
    # a bar for long runs where someone watches
    recording = simulate(scene, progress=sys.stderr.isatty() and scene.duration > 60)
    recording.save(snakemake.output[0])
    print(f"{scene.duration:g} s in {recording.wall:.3g} s")
