# Extremes of parameters, steps and states: every case completes with its invariants in bounds or is refused.

EXTREMES = ("solvers", "stability", "restitution", "outcomes", "long_run")


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


rule extremes:
    """The edges of every parameter; by name an hour of simulated running and a thousand random scenes, else the short form."""
    input:
        needs("extremes.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: **extremes_outputs(R)
    params: form=CONFIG.studies.extremes.full.model_dump()
    log: f"{R}/logs/extremes.log"
    benchmark: f"{R}/benchmarks/extremes.tsv"
    message: "Extremes: every case completes within bounds or is refused"
    script: "../scripts/extremes.py"


use rule extremes as extremes_short with:
    output: **extremes_outputs(f"{R}/short")
    params: form=CONFIG.studies.extremes.short.model_dump()
    log: f"{R}/logs/extremes_short.log"
    benchmark: f"{R}/benchmarks/extremes_short.tsv"
    message: "Extremes in short"
