# The runs, after the kernels are compiled and, if a tolerance is asked for, fidelity and step are picked.

# records and their coarse twins take fidelity and step from the planner where the configuration asks for it
PLANNED = [run for speed in SPEEDS for run in (speed, f"coarse/{speed}")] if CONFIG.records.plan else []


rule warm_up:
    """Compile the kernels once: parallel jobs on a cold cache would each compile them."""
    input: needs("warm_up.py")
    output: KERNELS
    params:
        rig=CONFIG.rig,
        integrator="semi_implicit",
    log: f"{R}/logs/warm_up.log"
    benchmark: f"{R}/benchmarks/warm_up.tsv"
    message: "Compiling the kernels"
    script: "../scripts/warm_up.py"


use rule warm_up as warm_up_method with:
    input:
        needs("warm_up.py"),
        KERNELS,
    output: method_kernels("{integrator}")
    params:
        rig=CONFIG.rig,
        integrator=lambda wildcards: wildcards.integrator,
    wildcard_constraints: integrator="linearly_implicit|rk4"
    log: f"{R}/logs/warm_up/{{integrator}}.log"
    benchmark: f"{R}/benchmarks/warm_up/{{integrator}}.tsv"
    message: "Compiling the kernels of {wildcards.integrator}"


if PLANNED:

    rule plan:
        """The cheapest fidelity, step and duration that keep the tolerance of records.plan in its data."""
        input:
            needs("plan.py"),
            data=CONFIG.records.plan.data,
            rig=CONFIG.rig,
        output: f"{R}/plan.json"
        params:
            asked=CONFIG.records.plan.model_dump(),
            speeds=CONFIG.records.speeds_rpm,
            radius=CONFIG.records.ring_radius_m,
            least_s=CONFIG.records.duration_s,
        log: f"{R}/logs/plan.log"
        benchmark: f"{R}/benchmarks/plan.tsv"
        message: "Planning the records"
        script: "../scripts/plan.py"


def runs_of(folder, scenes):
    """Recordings and costs of scenes below a folder, and their names."""
    return dict(
        recordings=[f"{folder}/runs/{run}.npz" for run in scenes],
        costs=[f"{folder}/runs/{run}.cost.json" for run in scenes],
    )


rule simulate:
    """One run: settle, start, record."""
    input:
        needs("simulate.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
        plan=lambda wildcards: f"{R}/plan.json" if wildcards.run in PLANNED else [],
    output:
        recording=f"{R}/runs/{{run}}.npz",
        cost=f"{R}/runs/{{run}}.cost.json",
    params:
        # what the run is asked to do: a change in the configuration reruns only the runs it touches
        scene=lambda wildcards: plain_scene(SCENES[wildcards.run]),
    log: f"{R}/logs/simulate/{{run}}.log"
    benchmark: f"{R}/benchmarks/simulate/{{run}}.tsv"
    message: "Simulating {wildcards.run}"
    script: "../scripts/simulate.py"


use rule simulate as simulate_other with:
    input:
        needs("simulate.py"),
        rig=lambda wildcards: CONFIG.other_rigs[wildcards.other].rig,
        kernels=KERNELS,
        plan=[],
    output:
        recording=f"{R}/rigs/{{other}}/runs/{{run}}.npz",
        cost=f"{R}/rigs/{{other}}/runs/{{run}}.cost.json",
    params: scene=lambda wildcards: plain_scene(OTHERS[wildcards.other][wildcards.run])
    log: f"{R}/logs/rigs/{{other}}/simulate/{{run}}.log"
    benchmark: f"{R}/benchmarks/rigs/{{other}}/simulate/{{run}}.tsv"
    message: "Simulating {wildcards.run} on {wildcards.other}"


def ring_files(folder, ending):
    """What the runs with one ring give, a file a speed."""
    return [f"{folder}/runs/ring/{rpm:g}rpm_{{ring}}.{ending}" for rpm in CONFIG.ring_study.speeds_rpm]


def ring_scenes(scenes, ring):
    return [plain_scene(scenes[f"ring/{rpm:g}rpm_{ring}"]) for rpm in CONFIG.ring_study.speeds_rpm]


rule ring_runs:
    """One ring at every speed, from one settled loop, each until its contacts are known."""
    input:
        needs("ring_runs.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        recordings=ring_files(R, "npz"),
        costs=ring_files(R, "cost.json"),
    params:
        scenes=lambda wildcards: ring_scenes(SCENES, wildcards.ring),
        known=CONFIG.known.model_dump(),
    log: f"{R}/logs/ring/{{ring}}.log"
    benchmark: f"{R}/benchmarks/ring/{{ring}}.tsv"
    message: "Simulating the ring {wildcards.ring}"
    script: "../scripts/ring_runs.py"


use rule ring_runs as ring_runs_other with:
    input:
        needs("ring_runs.py"),
        rig=lambda wildcards: CONFIG.other_rigs[wildcards.other].rig,
        kernels=KERNELS,
    output:
        recordings=ring_files(f"{R}/rigs/{{other}}", "npz"),
        costs=ring_files(f"{R}/rigs/{{other}}", "cost.json"),
    params:
        scenes=lambda wildcards: ring_scenes(OTHERS[wildcards.other], wildcards.ring),
        known=lambda wildcards: CONFIG.known_of(wildcards.other).model_dump(),
    log: f"{R}/logs/rigs/{{other}}/ring/{{ring}}.log"
    benchmark: f"{R}/benchmarks/rigs/{{other}}/ring/{{ring}}.tsv"
    message: "Simulating the ring {wildcards.ring} on {wildcards.other}"
