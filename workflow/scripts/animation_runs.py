from trackdyn.sweeps.job import logged

from trackdyn import Scene, load_rig, simulate

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    pitches = tuple(range(1, rig.chain.pitches + 1))
    for fields, path in zip(snakemake.params.scenes, snakemake.output, strict=True):
        # one turn of the sprocket, and the sample that closes it
        interval = fields["frame_interval"]
        turn = 60 * rig.sprocket.transmission_ratio / fields["motor_rpm"]
        duration = (int(turn / interval) + 1) * interval
        simulate(Scene(rig, duration=duration, pitches=pitches, **fields)).save(path)
        print(path)
