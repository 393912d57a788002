# The runs, after the kernels are compiled.


def compiling(method):
    """A short run of a method, as plain data: any step compiles the same kernels, a longer one may be refused."""
    fields = {"space": "spatial"} if method == "spatial" else {"integrator": method}
    if method in ("rk4", "spatial"):  # which have no tensioner on its spring
        fields |= {"tension": "locked"}
    return {"motor_rpm": 115.0, "duration": 0.01, "lead_in": 0.0, "ramp": 0.01, "step": 1e-5} | fields


rule warm_up:
    """Compile the kernels once: parallel jobs on a cold cache would each compile them."""
    input: rig=CONFIG.rig
    output: KERNELS
    params: scenes=[compiling("semi_implicit")]
    script: "../trackdyn_replication/pipeline/runs.py"


use rule warm_up as warm_up_method with:
    input: KERNELS, rig=CONFIG.rig
    output: method_kernels("{method}")
    params: scenes=lambda wildcards: [compiling(wildcards.method)]
    wildcard_constraints: method="linearly_implicit|rk4|spatial"
    message: "Compiling the kernels of {wildcards.method}"


def scenes_of(runs):
    """Runs by the wildcards of a job, as plain data for the parameters of a rule."""
    return lambda wildcards: [SCENES[run.format(**wildcards)].model_dump(mode="json", exclude={"rig"}) for run in runs]


rule simulate:
    """One run: settle, start, record."""
    input: rig=CONFIG.rig, kernels=KERNELS
    output: recording("{run}")
    # fields of the scene: a change in the configuration reruns only the runs it touches
    params: scenes=scenes_of(["{run}"])
    message: "Simulating {wildcards.run}"
    script: "../trackdyn_replication/pipeline/runs.py"


OF_A_SPEED = [f"ring/{{rpm}}rpm_{ring_name(radius)}" for radius in CONFIG.ring_study.rings]


rule ring_runs:
    """Every ring of the study at one speed, and none: a process for each would spend a third of its time on its start."""
    input: rig=CONFIG.rig, kernels=KERNELS
    output: [recording(run) for run in OF_A_SPEED]
    params: scenes=scenes_of(OF_A_SPEED), stop_rule=CONFIG.stop_rule.model_dump()
    message: "The ring study: {wildcards.rpm} rpm"
    script: "../trackdyn_replication/pipeline/runs.py"
