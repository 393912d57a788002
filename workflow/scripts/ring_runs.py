import json

from _script import logged

from trackdyn import Scene, load_rig
from trackdyn.loop import Loop
from trackdyn.replacing import write_text
from trackdyn.study.settings import Known
from trackdyn.study.steady import run_steady

with logged(snakemake):
    rig, known = load_rig(snakemake.input.rig), Known(**snakemake.params.known)
    scenes = [Scene(rig, **fields | {"pitches": tuple(fields["pitches"])}) for fields in snakemake.params.scenes]
    settled = Loop(scenes[0])
    for scene, out, cost in zip(scenes, snakemake.output.recordings, snakemake.output.costs, strict=True):
        fields = {name: getattr(scene, name) for name in ("motor_rpm", "duration", "step")}
        recording, answered = run_steady(settled.changed(**fields), known)
        recording.save(out)
        seconds = len(recording.time) / recording.rate
        write_text(cost, json.dumps({"wall_s": recording.wall, "simulated_s": seconds, "known": answered}))
        print(f"{out}: {seconds:g} s from {recording.begin:g} s on, {'known' if answered else 'not known'}")
