# Extremes of parameters, steps and states: every case completes with its invariants in bounds or is refused.

rule extremes_part:
    """Some families of the extremes."""
    input: rig=CONFIG.rig, kernels=SEVERAL_METHODS
    output: f"{R}/extremes/{{family}}.csv"
    params: study=CONFIG.studies.extremes.model_dump()
    priority: 30
    message: "Extremes: {wildcards.family}"
    script: "../trackdyn_replication/study/extremes/run.py"


rule extremes:
    """The edges of every parameter: all parts together."""
    input: parts=[f"{R}/extremes/{family}.csv" for family in parts_of(CONFIG.studies.extremes)]
    output:
        csv=f"{R}/extremes.csv", chunks=f"{R}/extremes_long_run.csv", summary=f"{R}/tables/extremes.csv",
        short_runs=f"{R}/tables/extremes_short_runs.csv",
        solvers=figure("extremes_solvers"), stability=figure("extremes_stability"),
    params: study=CONFIG.studies.extremes.model_dump()
    script: "../trackdyn_replication/report/figures/extremes.py"
