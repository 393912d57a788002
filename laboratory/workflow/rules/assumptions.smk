# The map from assumptions to claims (docs/assumptions.md): one job an assumption, rows kept as they come. `assumptions` is
# asked for by name; its short form is one alternative that needs no kernels of its own.

ASSUMPTIONS = load_assumptions("config/assumptions.yaml")


def assumption_files(wildcards):
    """What was found under each assumption of a form, in their order."""
    names = [one.slug for one in ASSUMPTIONS.assumptions(form_name(wildcards))]
    return [f"{R}/{wildcards.short}assumptions/{name}.json" for name in names]


rule assumption:
    """The rig with one assumption changed, fitted anew, in the ring study and the meshing process."""
    input:
        needs("assumption.py"),
        rig=POSSIBLE,
        config="config/assumptions.yaml",
        fit="config/fit.yaml",
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output: f"{R}/{{short}}assumptions/{{assumption}}.json"
    params:
        form=form_name,
        store=f"{R}/assumptions/rows",
    wildcard_constraints: assumption=r"[\w.]+"
    log: f"{R}/logs/{{short}}assumptions/{{assumption}}.log"
    message: "Assumptions: {wildcards.short}{wildcards.assumption}"
    script: "../scripts/assumption.py"


rule assumptions_form:
    """Every claim under every assumption."""
    input:
        needs("assumptions.py"),
        found=assumption_files,
        config="config/assumptions.yaml",
        claims="config/claims.yaml",
    output:
        csv=f"{R}/{{short}}assumptions.csv",
        rigs=f"{R}/{{short}}assumptions_rigs.csv",
        table=f"{R}/{{short}}tables/assumptions.csv",
        md=f"{R}/{{short}}tables/assumptions.md",
        figure=figure("assumptions", "{short}"),
    params: form=form_name
    log: f"{R}/logs/{{short}}assumptions.log"
    message: "The map from assumptions to claims"
    script: "../scripts/assumptions.py"


rule assumptions:
    """The map in full; by name, an hour of a core."""
    input: full(rules.assumptions_form)


rule assumptions_pages:
    """Measured part and picture of docs/assumptions.md from the present results. Asked for by name, as `pictures` is."""
    input: f"{R}/assumptions.csv", f"{R}/assumptions_rigs.csv", f"{R}/figures/assumptions.png"
    log: f"{R}/logs/assumptions/pages.log"
    message: "Measured parts of the page on assumptions"
    shell:
        "{sys.executable} -m replication.report.filled {input} > {log} 2>&1"
