# The benchmark for every multibody code (docs/benchmark.md): error and CPU time of each method on each problem.
# `benchmark` is asked for by name; its short form, our own methods alone, as `benchmark_short`.

FIELD = Path(workflow.basedir) / "benchmarks" / "field"
FIELD_SOURCES = sorted({
    str(file.relative_to(workflow.basedir))
    for script in FIELD.glob("*.py")
    for file in [script, *imported_files(script, Path(workflow.basedir))]
})
BENCHMARK = f"{R}/benchmark/{{short}}{{problem}}"


rule benchmark_problem:
    """Every setting of every code on one problem, one thread each; a code that is missing fails by name."""
    input: FIELD_SOURCES
    output:
        csv=f"{BENCHMARK}.csv",
        png=f"{BENCHMARK}.png",
        svg=f"{BENCHMARK}.svg",
    params:
        short=lambda wildcards: "short" if wildcards.short else "",
        python=sys.executable,
    wildcard_constraints: problem="free_chain|ring|teeth"
    log: f"{R}/logs/benchmark/{{short}}{{problem}}.log"
    message: "Benchmark: {wildcards.short}{wildcards.problem}"
    shell:
        "PYTHONPATH={workflow.basedir} {params.python} benchmarks/field/measure.py {wildcards.problem} {output.csv} "
        "{output.png} {params.short} > {log} 2>&1"


rule benchmark:
    input: expand(rules.benchmark_problem.output, problem=["free_chain", "ring", "teeth"], short="")


rule benchmark_short:
    input: expand(rules.benchmark_problem.output, problem=["free_chain", "ring", "teeth"], short="short/")
