# Rigs that the printed numbers exclude, wave by wave (docs/ensemble.md): `ensemble` is the full form, the numbers of its short
# one say nothing. Rows are kept as they come, so that a wave that is killed goes on where it was.

ENSEMBLE = load_ensemble("config/ensemble.yaml")
ENSEMBLE_INPUTS = dict(config="config/ensemble.yaml", rig=POSSIBLE, claims="config/claims.yaml")
ENSEMBLE_TABLES = ("rigs", "parameters", "claims", "pareto", "ranks", "study", "choices", "scorecard", "summary")
ENSEMBLE_PAGES = ("summary", "rigs", "claims", "parameters", "conflicts", "choices", "pareto", "local")
ENSEMBLE_FIGURES = ("fig23_bands", "fig24_bands", "conflicts", "pareto", "pairs", "choice")


def ensemble_form(wildcards):
    return ENSEMBLE.forms[form_name(wildcards)]


def ensemble_waves(wildcards):
    return [str(k + 1) for k in range(len(ensemble_form(wildcards).waves))]


def ensemble_before(wildcards):
    """Stages that the points of a stage come from."""
    waves, stage = ensemble_waves(wildcards), wildcards.stage
    if stage in ("compared", "1", "shipped"):
        return []
    before = ["last"] if stage == "study" else waves if stage == "last" else waves[: int(stage) - 1]
    local = [f"{L}/{wildcards.short}ensemble/points_local.csv"] if stage == "last" else []
    return ensemble_outputs_of(wildcards, before) + local


def ensemble_outputs_of(wildcards, stages):
    return [f"{L}/{wildcards.short}ensemble/outputs_{stage}.csv" for stage in ["compared", *stages]]


def ensemble_all_waves(wildcards):
    return ensemble_outputs_of(wildcards, ensemble_waves(wildcards))


def ensemble_stages(wildcards):
    return ensemble_outputs_of(wildcards, [*ensemble_waves(wildcards), "last", "shipped"])


rule ensemble_local:
    """Least squares from the least excluded rigs of all waves; rows are kept, so that a search goes on where it was."""
    input:
        lab_needs("ensemble_local.py"),
        ensemble_all_waves,
        kernels=[KERNELS, method_kernels("linearly_implicit")],
        **ENSEMBLE_INPUTS,
    output:
        points=f"{L}/{{short}}ensemble/points_local.csv",
        ends=f"{L}/{{short}}ensemble/local.csv",
    params:
        form=form_name,
        store=lambda wildcards: f"{L}/{wildcards.short}ensemble/searches",
    threads: 2
    log: f"{L}/logs/{{short}}ensemble/local.log"
    message: "Ensemble: local searches"
    script: "../scripts/ensemble_local.py"


rule ensemble_points:
    """Rigs of a stage: drawn from the ranges, or from where the emulators of all waves before exclude least."""
    input:
        lab_needs("ensemble_points.py"),
        ensemble_before,
        **ENSEMBLE_INPUTS,
    output:
        points=f"{L}/{{short}}ensemble/points_{{stage}}.csv",
        design=f"{L}/{{short}}ensemble/design_{{stage}}.parquet",
    params: form=form_name
    wildcard_constraints: stage=r"(?!local|conflicts)\w+"
    log: f"{L}/logs/{{short}}ensemble/points_{{stage}}.log"
    message: "Ensemble: rigs of the stage {wildcards.stage}"
    script: "../scripts/ensemble_points.py"


def ensemble_sweep(place, form):
    """What the stages of a form are run by."""
    return {
        "design": f"{L}/{place}/design_{{stage}}.parquet",
        "out": f"{L}/{place}/runs_{{stage}}.parquet",
        "store": f"{L}/{place}/rows", # of all stages: the last one has rigs of those before
        "logs": f"{L}/logs/{place}/{{stage}}_",
        "rig": POSSIBLE,
        "kernels": [KERNELS, method_kernels("linearly_implicit")],
        "batches": ENSEMBLE.forms[form].batches,
    }


module rigs:
    snakefile: "../../../workflow/sweep.smk"
    config: ensemble_sweep("ensemble", "full")


use rule * from rigs exclude all as ensemble_*


module rigs_short:
    snakefile: "../../../workflow/sweep.smk"
    config: ensemble_sweep("short/ensemble", "short")


use rule * from rigs_short exclude all as ensemble_short_*


rule ensemble_outputs:
    """Numbers of every rig of a stage that targets are compared with."""
    input:
        lab_needs("ensemble_outputs.py"),
        f"{L}/{{short}}ensemble/runs_{{stage}}.parquet",
        **ENSEMBLE_INPUTS,
    output: f"{L}/{{short}}ensemble/outputs_{{stage}}.csv"
    params: form=form_name
    wildcard_constraints: stage=r"(?!study|local|conflicts)\w+"
    log: f"{L}/logs/{{short}}ensemble/outputs_{{stage}}.log"
    message: "Ensemble: outputs of the stage {wildcards.stage}"
    script: "../scripts/ensemble_outputs.py"


rule ensemble_conflicts:
    """Sets of claims that no rig which ran shows, searched one by one; rows are kept, shared with the local searches."""
    input:
        lab_needs("ensemble_conflicts.py"),
        ensemble_stages,
        kernels=[KERNELS, method_kernels("linearly_implicit")],
        **ENSEMBLE_INPUTS,
    output:
        conflicts=f"{L}/{{short}}ensemble/conflicts.csv",
        points=f"{L}/{{short}}ensemble/points_conflicts.csv",
    params:
        form=form_name,
        store=lambda wildcards: f"{L}/{wildcards.short}ensemble/searches",
    threads: 2
    log: f"{L}/logs/{{short}}ensemble/conflicts.log"
    message: "Ensemble: searches for claims that go together"
    script: "../scripts/ensemble_conflicts.py"


rule ensemble_verdicts:
    """Rigs, what remains of every range, claims over all rigs, and which ring to choose."""
    input:
        lab_needs("ensemble.py"),
        ensemble_stages,
        f"{L}/{{short}}ensemble/runs_study.parquet",
        f"{L}/{{short}}ensemble/conflicts.csv",
        card=f"{R}/claims.csv",
        metrics=f"{R}/rigs/possible/metrics.csv",
        **ENSEMBLE_INPUTS,
    output:
        **{name: f"{L}/{{short}}ensemble/{name}.csv" for name in ENSEMBLE_TABLES},
        figures=[f"{L}/{{short}}ensemble/{name}.{ending}" for name in ENSEMBLE_FIGURES for ending in ("png", "svg")],
    params: form=form_name
    log: f"{L}/logs/{{short}}ensemble/verdicts.log"
    message: "Ensemble: verdicts"
    script: "../scripts/ensemble.py"


rule ensemble:
    """Which rigs the printed numbers exclude; asked for by name. The short form's numbers say nothing."""
    input:
        f"{L}/ensemble/rigs.csv",
