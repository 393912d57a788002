# Extremes of parameters, steps and states: every case completes with its invariants in bounds or is refused.

EXTREMES = ("solvers", "stability", "restitution", "outcomes", "long_run")
EXTREMES_FORMS = {"full": CONFIG.studies.extremes.full, "short": CONFIG.studies.extremes.short}


def extremes_outputs(folder):
    """Files of one form of the extremes."""
    return dict(
        csv=f"{folder}/extremes.csv",
        chunks=f"{folder}/extremes_long_run.csv",
        seeds=f"{folder}/extremes_seeds.json",
        md=f"{folder}/tables/extremes.md",
        summary=f"{folder}/tables/extremes.csv",
        figures=[f"{folder}/figures/extremes_{name}.{ending}" for name in EXTREMES for ending in ("png", "svg")],
    )


def extremes_parts(form):
    """Files of the parts that run side by side."""
    return [f"{R}/extremes/{form}/{part}.csv" for part in parts_of(EXTREMES_FORMS[form])]


rule extremes_part:
    """Some families of the extremes."""
    input:
        needs("extremes_part.py"),
        rig=CONFIG.rig,
        kernels=SEVERAL_METHODS,
    output: f"{R}/extremes/{{form}}/{{part}}.csv"
    params: form=lambda wildcards: EXTREMES_FORMS[wildcards.form].model_dump()
    wildcard_constraints: form="full|short"
    priority: 30
    log: f"{R}/logs/extremes_{{form}}/{{part}}.log"
    message: "Extremes, {wildcards.form}: {wildcards.part}"
    script: "../scripts/extremes_part.py"


rule extremes:
    """The edges of every parameter; by name an hour of simulated running and a thousand random scenes, else the short form."""
    input:
        needs("extremes.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
        parts=extremes_parts("full"),
    output: **extremes_outputs(R)
    params: form=CONFIG.studies.extremes.full.model_dump()
    log: f"{R}/logs/extremes.log"
    message: "Extremes: every case completes within bounds or is refused"
    script: "../scripts/extremes.py"


use rule extremes as extremes_short with:
    input:
        needs("extremes.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
        parts=extremes_parts("short"),
    output: **extremes_outputs(f"{R}/short")
    params: form=CONFIG.studies.extremes.short.model_dump()
    log: f"{R}/logs/extremes_short.log"
    message: "Extremes in short"
