"""Simulate scenes, and write their recordings."""

from trackdyn.sweeps.snakemake_job import run_job

import sys

from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.simulate import simulate


@run_job
def main(job) -> None:
    """Rules `simulate`, `animation_run`, `warm_up`: a recording a scene."""
    rig = load_rig(job.input.rig)
    for fields, path in zip(job.params.scenes, job.output, strict=True):
        scene = Scene(rig, **fields)
        # a bar for long runs where someone watches
        recording = simulate(scene, progress=sys.stderr.isatty() and scene.duration > 60)
        recording.save(path)
        print(f"{path}: {scene.duration:g} s in {recording.wall:.3g} s")
