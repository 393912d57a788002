# The benchmark for every multibody code (docs/benchmark.md): error and CPU time of each method on each problem. `benchmark` is
# the full form; `benchmark_short` has our own methods alone.

FIELD = Path(ROOT) / "benchmarks" / "field"
FIELD_SOURCES = sorted({
    str(file.relative_to(ROOT))
    for script in FIELD.glob("*.py")
    for file in [script, *imported_files(script, Path(ROOT))]
})
BENCHMARK = f"{L}/benchmark/{{short}}benchmark"
PROBLEMS = ["free_chain", "ring", "teeth"]


rule benchmark_problem:
    """Every setting of every code on one problem, one thread each; a code that is missing fails by name."""
    input: FIELD_SOURCES
    output:
        csv=f"{BENCHMARK}_{{problem}}.csv",
        png=f"{BENCHMARK}_{{problem}}.png",
        svg=f"{BENCHMARK}_{{problem}}.svg",
    params:
        short=lambda wildcards: "short" if wildcards.short else "",
        python=sys.executable,
    wildcard_constraints: problem="|".join(PROBLEMS)
    log: f"{L}/logs/benchmark/{{short}}{{problem}}.log"
    message: "Benchmark: {wildcards.short}{wildcards.problem}"
    shell:
        "PYTHONPATH={ROOT} {params.python} benchmarks/field/measure.py {wildcards.problem} {output.csv} "
        "{output.png} {params.short} > {log} 2>&1"


rule benchmark_form:
    """All problems in one table."""
    input:
        lab_needs("benchmark_table.py"),
        parts=expand(rules.benchmark_problem.output.csv, problem=PROBLEMS, allow_missing=True),
    output: f"{BENCHMARK}.csv"
    log: f"{L}/logs/benchmark/{{short}}table.log"
    message: "Benchmark: {wildcards.short}table"
    script: "../scripts/benchmark_table.py"


rule benchmark:
    input:
        expand(rules.benchmark_problem.output, problem=PROBLEMS, short=""),
        full(rules.benchmark_form),


rule benchmark_short:
    input:
        expand(rules.benchmark_problem.output, problem=PROBLEMS, short="short/"),
        short(rules.benchmark_form),
