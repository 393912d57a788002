from trackdyn.sweeps.job import logged

import sys

from trackdyn import Scene, load_rig, simulate

with logged(snakemake):
    fields = snakemake.params.scene | {"pitches": tuple(snakemake.params.scene["pitches"])}
    scene = Scene(load_rig(snakemake.input.rig), **fields)
    # a bar for long runs where someone watches
    recording = simulate(scene, progress=sys.stderr.isatty() and scene.duration > 60)
    recording.save(snakemake.output[0])
    print(f"{scene.duration:g} s in {recording.wall:.3g} s")
