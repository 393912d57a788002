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


def is_ring(run):
    """Whether a run belongs to the ring study: it ends when its contacts are known, and shares a job with others."""
    return run.startswith("ring/")


def recordings(scenes, place=""):
    """Recordings of scenes, those of another rig in a place of their own."""
    return [recording(run, place) for run in scenes]


rule simulate:
    """One run: settle, start, record."""
    input:
        needs("pipeline/runs.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: recording("{run}")
    params:
        # what the run is asked to do: a change in the configuration reruns only the runs it touches
        scenes=lambda wildcards: [plain_scene(SCENES[wildcards.run])],
    log: f"{R}/logs/simulate/{{run}}.log"
    message: "Simulating {wildcards.run}"
    script: "../replication/pipeline/runs.py"


use rule simulate as simulate_other with:
    input:
        needs("pipeline/runs.py"),
        rig=lambda wildcards: CONFIG.other_rigs[wildcards.other].rig,
        kernels=KERNELS,
    output: recording("{run}", "rigs/{other}/")
    params: scenes=lambda wildcards: [plain_scene(OTHERS[wildcards.other][wildcards.run])]
    log: f"{R}/logs/rigs/{{other}}/simulate/{{run}}.log"
    message: "Simulating {wildcards.run} on {wildcards.other}"


# The ring study: a rig's rings in turn, each settled once for all speeds and three to a job, since to start a job costs as
# much as a run.
RING_STUDIES = {"": (CONFIG.rig, SCENES, CONFIG.known)}
RING_STUDIES |= {f"rigs/{name}/": (other.rig, OTHERS[name], CONFIG.known_of(name)) for name, other in CONFIG.other_rigs.items()}

for place, (rig_file, scenes, known) in RING_STUDIES.items():
    of_ring = {run: scene for run, scene in scenes.items() if is_ring(run)}
    rings = list(dict.fromkeys(scene.ring_radius for scene in of_ring.values()))
    for first in range(0, len(rings), 3):
        part = {run: scene for run, scene in of_ring.items() if scene.ring_radius in rings[first : first + 3]}
        name = f"{place.removeprefix('rigs/').replace('/', '_')}{ring_name(rings[first])}"

        rule:
            name: f"ring_{name}".replace(".", "_")
            input:
                needs("pipeline/steady_runs.py"),
                rig=rig_file,
                kernels=KERNELS,
            output: recordings(part, place)
            params:
                scenes=[plain_scene(scene) for scene in part.values()],
                known=known.model_dump(),
            log: f"{R}/logs/ring/{name}.log"
            message: f"The ring study: {', '.join(part)}"
            script: "../replication/pipeline/steady_runs.py"
