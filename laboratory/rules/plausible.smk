# Which sentences of the paper follow from the model (docs/answer.md). Rows are kept as they come, so that a study that is killed goes on.

PLAUSIBLE = ("draws", "sentences", "claims", "map", "values", "near")


rule plausible_tables:
    """Tracks sampled from assumed ranges, run and judged; neighbours of the default rig."""
    input:
        config="config/plausible.yaml",
        claims="config/claims.yaml",
        rigs=load_plausible("config/plausible.yaml").rigs,
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output: **{name: f"{L}/{{short}}plausible_{name}.csv" for name in PLAUSIBLE}
    params:
        short=lambda wildcards: bool(wildcards.short),
        store=lambda wildcards: f"{L}/{wildcards.short}plausible",
    # the short form runs next to other jobs, and begins early
    threads: lambda wildcards: 1 if wildcards.short else 2
    priority: 60
    log: f"{L}/logs/{{short}}plausible.log"
    script: "../plausible/study.py"


rule mobilised:
    """Friction of the ring by its creep slope: the default rig with other transition velocities (half a minute)."""
    input:
        config="config/plausible.yaml",
        rigs=load_plausible("config/plausible.yaml").rigs,
        kernels=KERNELS,
    output: f"{L}/plausible_mobilised.csv"
    log: f"{L}/logs/plausible_mobilised.log"
    script: "../plausible/study.py"


rule plausible_figure:
    """Maps of the share of plausible tracks that show each sentence."""
    input:
        sentences=f"{L}/{{short}}plausible_sentences.csv",
        map=f"{L}/{{short}}plausible_map.csv",
        draws=f"{L}/{{short}}plausible_draws.csv",
        mobilised=f"{L}/plausible_mobilised.csv",
    output: multiext(f"{L}/{{short}}figures/plausible", ".png", ".svg")
    log: f"{L}/logs/{{short}}plausible_figure.log"
    script: "../report/plausible.py"


rule grip_table:
    """Effect of the ring's tangential force: tracks that mesh as printed, with other laws of friction."""
    input:
        config="config/plausible.yaml",
        draws="data/plausible/plausible_draws.csv",
        rig=load_plausible("config/plausible.yaml").rig,
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output: f"{L}/{{short}}grip.csv"
    params:
        short=lambda wildcards: bool(wildcards.short),
        store=lambda wildcards: f"{L}/{wildcards.short}plausible",
    threads: lambda wildcards: 1 if wildcards.short else 2
    log: f"{L}/logs/{{short}}grip.log"
    script: "../plausible/grip.py"


rule grip:
    """The study of the ring's tangential force in full (some two hours on two cores; ask for it by name)."""
    input: f"{L}/grip.csv"


rule rings_table:
    """The ring to choose by the force of a tooth and by durations on sampled tracks, those that mesh as printed first."""
    input:
        config="config/plausible.yaml",
        draws="data/plausible/plausible_draws.csv",
        rig=load_plausible("config/plausible.yaml").rig,
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output: f"{L}/{{short}}rings.csv"
    params:
        short=lambda wildcards: bool(wildcards.short),
        store=lambda wildcards: f"{L}/{wildcards.short}plausible",
    threads: lambda wildcards: 1 if wildcards.short else 2
    log: f"{L}/logs/{{short}}rings.log"
    script: "../plausible/rings.py"


rule rings:
    """The study of the ring to choose in full (some twenty minutes of a processor; ask for it by name)."""
    input: f"{L}/rings.csv"


rule default_rig:
    """File of the default rig, a draw of the sample (some seconds)."""
    input:
        config="config/plausible.yaml",
        rigs=load_plausible("config/plausible.yaml").rigs,
    output: f"{L}/rigs/paper.yaml"
    log: f"{L}/logs/default_rig.log"
    script: "../plausible/searched_rigs.py"


SEARCHES = ("slips", "shears", "grips")


rule searched_rigs:
    """Files of rigs searched for three rings, and the rows of the searches that make them (an hour; ask by name)."""
    input:
        config="config/plausible.yaml",
        claims="config/claims.yaml",
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output:
        rigs=[f"{L}/rigs/{name}.yaml" for name in SEARCHES],
        rows=f"{L}/search_rows.csv",
    params:
        searches=SEARCHES,
        store=f"{L}/plausible",
    threads: 2
    log: f"{L}/logs/searched_rigs.log"
    script: "../plausible/searched_rigs.py"


rule plausible:
    """The study in full (some four processor hours; ask for it by name)."""
    input:
        full(rules.plausible_tables),
        full(rules.plausible_figure),
