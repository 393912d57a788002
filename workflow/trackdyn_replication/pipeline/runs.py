"""Simulate scenes, and write their recordings."""

from trackdyn.sweeps.snakemake_job import run_job

import sys

from trackdyn.measure.stopping import run_steady
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate


@run_job
def main(job) -> None:
    """Rules `simulate`, `animation_run`, `warm_up`; `ring_runs`, whose scenes run until their contacts are known."""
    rig, rule, starts = load_rig(job.input.rig), job.params.get("stop_rule"), SettledLoops()
    for fields, path in zip(job.params.scenes, job.output, strict=True):
        scene = Scene(rig, **fields)
        if rule:
            recording, converged = run_steady(scene, StopRule(**rule), starts)
        else:  # a bar for long runs where someone watches
            recording, converged = simulate(scene, sys.stderr.isatty() and scene.duration > 60, starts), True
        recording.save(path, compress=bool(rule))
        words = "" if converged else ", ended by its longest duration"
        print(f"{path}: {recording.seconds:g} s in {recording.wall:.3g} s{words}", flush=True)
