# Which rigs show what the paper says (docs/answer.md). Rows are kept as they come, so that a search that is killed goes on.


rule answer_table:
    """Searches of every question (short form: three rows of one); where they end and what the best rigs show."""
    input:
        lab_needs("report/answer.py"),
        config="config/answer.yaml",
        claims="config/claims.yaml",
        rigs=load_answer("config/answer.yaml").rigs(),
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output:
        **{name: f"{L}/{{short}}answer_{name}.csv" for name in ("ends", "costs", "verdicts")},
        **figures(["answer"], f"{LAB}{{short}}"),
    params:
        short=lambda wildcards: bool(wildcards.short),
        store=lambda wildcards: f"{L}/{wildcards.short}answer",
    # the short form runs beside others, and begins early
    threads: lambda wildcards: 1 if wildcards.short else 2
    priority: 60
    log: f"{L}/logs/{{short}}answer.log"
    message: "Searches for rigs that show what the paper says"
    script: "../report/answer.py"


rule answer_near:
    """Rigs near the best ones, with every free value moved a little; profiles of contested assumptions."""
    input:
        lab_needs("inference/answer/study.py"),
        ends=f"{L}/answer_ends.csv",
        config="config/answer.yaml",
        claims="config/claims.yaml",
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output: **{name: f"{L}/answer_{name}.csv" for name in ("robustness", "profiles")},
    params: store=f"{L}/answer"
    threads: 2
    log: f"{L}/logs/answer_near.log"
    message: "Rigs near the best ones"
    script: "../inference/answer/study.py"


rule answer:
    """The searches in full (some ten processor hours; ask for it by name)."""
    input:
        full(rules.answer_table),
        rules.answer_near.output,
