# Extremes of parameters, steps and states: every case completes with its invariants in bounds or is refused.

rule extremes_part:
    """Some families of the extremes."""
    input: rig=CONFIG.rig, kernels=SEVERAL_METHODS
    output: f"{R}/{{short}}extremes/{{family}}.csv"
    params: form=form("extremes")
    priority: 30
    log: f"{R}/logs/{{short}}extremes/{{family}}.log"
    message: "Extremes: {wildcards.short}{wildcards.family}"
    script: "../replication/study/extremes/run.py"


rule extremes_form:
    """The edges of every parameter: all parts together."""
    input:
        parts=lambda wildcards: [
            f"{R}/{wildcards.short}extremes/{family}.csv" for family in parts_of(form_of("extremes", wildcards))
        ],
    output:
        csv=f"{R}/{{short}}extremes.csv",
        chunks=f"{R}/{{short}}extremes_long_run.csv",
        md=f"{R}/{{short}}tables/extremes.md",
        summary=f"{R}/{{short}}tables/extremes.csv",
        short_runs=multiext(f"{R}/{{short}}tables/extremes_short_runs", ".csv", ".md"),
        solvers=figure("extremes_solvers", "{short}"),
        stability=figure("extremes_stability", "{short}"),
    params: form=form("extremes")
    log: f"{R}/logs/{{short}}extremes.log"
    script: "../replication/report/figures/extremes.py"


rule extremes:
    """An hour of simulated running, hundreds of short runs; by name."""
    input: full(rules.extremes_form)
