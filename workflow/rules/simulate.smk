# The runs, after the kernels are compiled and, if a tolerance is asked for, fidelity and step are picked.

# records and their coarse twins take fidelity and step from the planner where the configuration asks for it
PLANNED = [run for speed in SPEEDS for run in (speed, f"coarse/{speed}")] if CONFIG.records.plan else []


rule warm_up:
    """Compile the kernels once: parallel jobs on a cold cache would each compile them."""
    input: needs("warm_up.py")
    output: KERNELS
    params: rig=CONFIG.rig
    log: f"{R}/logs/warm_up.log"
    benchmark: f"{R}/benchmarks/warm_up.tsv"
    message: "Compiling the kernels"
    script: "../scripts/warm_up.py"


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
