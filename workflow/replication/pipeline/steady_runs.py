"""Simulate scenes until their contacts are known, and write their recordings."""

from trackdyn.sweeps.snakemake_job import run_job

from trackdyn.measure.stopping import run_steady
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.simulation.settling import SettledLoops


@run_job
def main(job) -> None:
    """Rules `ring_runs`, `runs_without_ring`: the scenes share what they settle alike."""
    rig, rule, starts = load_rig(job.input.rig), StopRule(**job.params.stop_rule), SettledLoops()
    for fields, path in zip(job.params.scenes, job.output, strict=True):
        recording, converged = run_steady(Scene(rig, **fields), rule, starts)
        recording.save(path, compress=True)
        print(path, "converged" if converged else "ended by its longest duration", flush=True)
