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
    """Rules `simulate`, `animation_run`, `warm_up`; `ring_runs` and `runs_without_ring`, until contacts are known.

    Scenes of one job share what they settle alike.
    """
    rig, rule, starts = load_rig(job.input.rig), job.params.get("stop_rule"), SettledLoops()
    for fields, path in zip(job.params.scenes, job.output, strict=True):
        scene, ended = Scene(rig, **fields), ""
        if rule:
            recording, converged = run_steady(scene, StopRule(**rule), starts)
            ended = ", converged" if converged else ", ended by its longest duration"
        else:  # a bar for long runs where someone watches
            recording = simulate(scene, progress=sys.stderr.isatty() and scene.duration > 60)
        recording.save(path, compress=bool(rule))
        print(f"{path}: {recording.seconds:g} s in {recording.wall:.3g} s{ended}", flush=True)
