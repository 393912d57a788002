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
        message: "Planning the records"
        script: "../scripts/plan.py"


def is_ring(run):
    """Whether a run belongs to the ring study, which is a sweep: its rows are numbers, no recordings."""
    return run.startswith("ring/")


def runs_of(folder, scenes):
    """Recordings and costs of scenes below a folder."""
    recorded = [run for run in scenes if not is_ring(run)]
    return dict(
        recordings=[f"{folder}/runs/{run}.npz" for run in recorded],
        costs=[f"{folder}/runs/{run}.cost.json" for run in recorded],
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
    message: "Simulating {wildcards.run} on {wildcards.other}"


def sweep_row(run, rig, scene, known):
    """A run of the ring study as a row of a design: what differs from the defaults."""
    asked = {name: getattr(scene, name) for name in ("motor_rpm", "duration", "lead_in", "step")}
    ends = {f"known.{name}": value for name, value in known.model_dump(exclude={"longest_turns"}).items()}
    return {"name": run, "rig": rig, "ring_radius": scene.ring_radius or "none", **asked, **ends}


def ring_rows():
    """The ring study of every rig, a row of a sweep a run."""
    rigs = [(CONFIG.rig, SCENES, CONFIG.known)]
    rigs += [(other.rig, OTHERS[name], CONFIG.known_of(name)) for name, other in CONFIG.other_rigs.items()]
    return [sweep_row(run, rig, scene, known) for rig, scenes, known in rigs for run, scene in scenes.items() if is_ring(run)]


rule ring_design:
    """Every ring at every speed on every rig, each until its contacts are known."""
    localrule: True
    input: needs("ring_design.py")
    output: f"{R}/ring/design.csv"
    params: rows=ring_rows()
    log: f"{R}/logs/ring/design.log"
    message: "The ring study's runs"
    script: "../scripts/ring_design.py"


module ring:
    snakefile: "../sweep.smk"
    config:
        {
            "design": f"{R}/ring/design.csv",
            "out": f"{R}/ring/runs.parquet",
            "logs": f"{R}/logs/ring/",
            "rig": CONFIG.rig,
            "rigs": [other.rig for other in CONFIG.other_rigs.values()],
            "kernels": [KERNELS],
            # three rings of a rig, each settled once: to start a job costs as much as a run
            "batches": -(-len({(row["rig"], row["ring_radius"]) for row in ring_rows()}) // 3),
        }


use rule * from ring exclude all as ring_*

RING_RUNS = dict(ring=f"{R}/ring/runs.parquet", ring_costs=f"{R}/ring/runs.costs.csv")
