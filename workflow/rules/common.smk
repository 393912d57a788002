# Which sources a rule depends on: Snakemake does not see edits in an imported package.


def sources(*names):
    """Files of the package: a file by its name, a folder with everything in it."""
    found = []
    for name in names:
        path = Path(workflow.basedir) / "trackdyn" / name
        found += [path] if path.is_file() else sorted(path.rglob("*.py"))
    return [str(path.relative_to(workflow.basedir)) for path in found]


SIMULATOR = sources(
    "chain", "contact", "integrate", "parameters", "model.py", "scene.py", "fidelity.py", "space.py", "settling.py",
    "simulate.py", "recording.py",
)
# Named by the hash of the kernels' sources: other sources, another file, and everything that needs it runs.
KERNELS = f"{R}/kernels/{source_hash()}.txt"
# how the sensor's records are read
SENSOR = {"rate_hz": RIG.sensor.rate, "range_g": RIG.sensor.range}
MEASURES = sources("measure", "recording.py")


def recording(run):
    return f"{R}/runs/{run}.npz"


def plain_scene(run):
    """A scene of the pipeline as plain data, without the rig."""
    scene = SCENES[run].describe()
    del scene["rig"]
    return scene


def scene_parameters(wildcards):
    """What a run is asked to do: a change in the configuration reruns only the runs it touches."""
    return plain_scene(wildcards.run)


# slowest speed without a ring and with the paper's, fastest speed with the paper's
STABILITY_RUNS = [
    f"ring/{CONFIG.ring_study.speeds_rpm[0]:g}rpm_none",
    f"ring/{CONFIG.ring_study.speeds_rpm[0]:g}rpm_{CONFIG.records.ring_radius_m:.4g}",
    f"ring/{CONFIG.ring_study.speeds_rpm[-1]:g}rpm_{CONFIG.records.ring_radius_m:.4g}",
]
STABILITY_RUNS = [run for run in STABILITY_RUNS if run in SCENES]
