# The runs, after the kernels are compiled.


def compiling(integrator):
    """A short run of a method, as plain data: any step compiles the same kernels, a longer one may be refused."""
    free = {"tension": "locked"} if integrator == "rk4" else {}  # which has no tensioner on its spring
    return {"motor_rpm": 115.0, "duration": 0.01, "lead_in": 0.0, "ramp": 0.01, "step": 1e-5, "integrator": integrator} | free


rule warm_up:
    """Compile the kernels once: parallel jobs on a cold cache would each compile them."""
    input:
        needs("pipeline/runs.py"),
        rig=CONFIG.rig,
    output: KERNELS
    params: scenes=[compiling("semi_implicit")]
    log: f"{R}/logs/warm_up.log"
    message: "Compiling the kernels"
    script: "../replication/pipeline/runs.py"


use rule warm_up as warm_up_method with:
    input:
        needs("pipeline/runs.py"),
        KERNELS,
        rig=CONFIG.rig,
    output: method_kernels("{integrator}")
    params: scenes=lambda wildcards: [compiling(wildcards.integrator)]
    wildcard_constraints: integrator="linearly_implicit|rk4"
    log: f"{R}/logs/warm_up/{{integrator}}.log"
    message: "Compiling the kernels of {wildcards.integrator}"


# By the folder of a rig's results: its file, its scenes, and when contacts are known. That of the first rig is the folder of
# all; one rule makes the runs of every rig, and the wildcard `folder` tells them apart.
RIGS = {"": (CONFIG.rig, SCENES, CONFIG.stop_rule)}
RIGS |= {f"rigs/{name}/": (other.rig, OTHERS[name], CONFIG.known_of(name)) for name, other in CONFIG.other_rigs.items()}


def rig_of(wildcards):
    return RIGS[wildcards.folder][0]


def scenes_of(runs):
    """Runs by the wildcards of a job, as plain data for the parameters of a rule."""
    return lambda wildcards: [plain_scene(RIGS[wildcards.folder][1][run.format(**wildcards)]) for run in runs]


rule simulate:
    """One run: settle, start, record."""
    input:
        needs("pipeline/runs.py"),
        rig=rig_of,
        kernels=KERNELS,
    output: recording("{run}", "{folder}")
    # what the run is asked to do: a change in the configuration reruns only the runs it touches
    params: scenes=scenes_of(["{run}"])
    log: f"{R}/logs/{{folder}}simulate/{{run}}.log"
    message: "Simulating {wildcards.folder}{wildcards.run}"
    script: "../replication/pipeline/runs.py"


OF_A_RING = [f"ring/{rpm:g}rpm_{{radius}}" for rpm in CONFIG.ring_study.speeds_rpm]


rule ring_runs:
    """A ring of the study at every speed, settled once for all of them."""
    input:
        needs("pipeline/steady_runs.py"),
        rig=rig_of,
        kernels=KERNELS,
    output: [recording(run, "{folder}") for run in OF_A_RING]
    params:
        scenes=scenes_of(OF_A_RING),
        stop_rule=lambda wildcards: RIGS[wildcards.folder][2].model_dump(),
    log: f"{R}/logs/{{folder}}ring/{{radius}}.log"
    message: "The ring study: {wildcards.folder}{wildcards.radius}"
    script: "../replication/pipeline/steady_runs.py"
