import json
import sys
from pathlib import Path

from _script import logged

from trackdyn import Scene, load_rig, simulate
from trackdyn.files import write_text

with logged(snakemake):
    fields = snakemake.params.scene | {"pitches": tuple(snakemake.params.scene["pitches"])}
    if snakemake.input.plan:
        fields |= json.loads(Path(snakemake.input.plan).read_text(encoding="utf-8"))[snakemake.wildcards.run]
    scene = Scene(load_rig(snakemake.input.rig), **fields)
    # a bar for long runs where someone watches
    recording = simulate(scene, progress=sys.stderr.isatty() and scene.duration > 60)
    recording.save(snakemake.output.recording)
    cost = {"wall_s": recording.wall, "simulated_s": scene.duration, "wall_s_per_s": recording.wall / scene.duration}
    write_text(snakemake.output.cost, json.dumps(cost))
    print(cost)
