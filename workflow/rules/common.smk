# Which sources a rule depends on: Snakemake does not see edits in an imported package.


def sources(*names):
    """Files of the package: a file by its name, a folder with everything in it."""
    found = []
    for name in names:
        path = Path(workflow.basedir) / "trackdyn" / name
        found += [path] if path.is_file() else sorted(path.rglob("*.py"))
    return [str(path.relative_to(workflow.basedir)) for path in found]


SIMULATOR = sources(
    "chain", "contact", "integrate", "parameters", "model.py", "scene.py", "simulate.py", "recording.py"
)
MEASURES = sources("measure", "recording.py")


def recording(run):
    return f"{R}/runs/{run}.npz"


def scene_parameters(wildcards):
    """What a run is asked to do: a change in the configuration reruns only the runs it touches."""
    scene = SCENES[wildcards.run].describe()
    del scene["rig"]
    return scene
