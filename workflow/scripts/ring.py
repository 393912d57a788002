from trackdyn.sweeps.job import logged

from trackdyn import Loop, Scene, load_rig
from trackdyn.measure.stopping import run_steady
from trackdyn.scene.stop_rule import StopRule
from trackdyn.simulation.settling import SettledLoops

with logged(snakemake):
    rig, rule, starts = load_rig(snakemake.input.rig), StopRule(**snakemake.params.known), SettledLoops()
    for (run, fields), path in zip(snakemake.params.scenes.items(), snakemake.output, strict=True):
        scene = Scene(rig, **fields | {"pitches": tuple(fields["pitches"])})
        recording, converged = run_steady(Loop(scene, starts), rule)
        recording.save(path, compress=True)
        print(run, "converged" if converged else "ended by its longest duration", flush=True)
