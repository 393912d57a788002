# Sect. 5: metrics of every run, Table 1 and 3, Figures 15, 17, 18, the loop.


rule metrics:
    """One row a run: the numbers that tables, figures and claims are made of."""
    input:
        MEASURES,
        recordings=[recording(run) for run in SCENES],
        costs=[f"{R}/runs/{run}.cost.json" for run in SCENES],
    output:
        f"{R}/metrics.csv",
    params:
        runs=list(SCENES),
    log:
        f"{R}/logs/metrics.log",
    benchmark:
        f"{R}/benchmarks/metrics.tsv"
    message:
        "Measuring {output}"
    script:
        "../scripts/metrics.py"


rule parameters:
    """Every parameter with its kind: what is printed, derived, assumed and fitted."""
    input:
        sources("parameters", "report/tables.py"),
        rig=CONFIG.rig,
    output:
        csv=report(f"{R}/tables/parameters.csv", caption="../report/parameters.rst", category="Rig and costs"),
        md=f"{R}/tables/parameters.md",
        groove_csv=report(f"{R}/tables/table1.csv", caption="../report/table1.rst", category="Rig and costs"),
        groove_md=f"{R}/tables/table1.md",
    log:
        f"{R}/logs/parameters.log",
    benchmark:
        f"{R}/benchmarks/parameters.tsv"
    message:
        "Table 1 and the list of parameters"
    script:
        "../scripts/parameters.py"


rule statistics:
    """Table 3 and the main lines, beside the sensor's."""
    input:
        MEASURES,
        sources("report/tables.py", "paper/printed.py"),
        metrics=f"{R}/metrics.csv",
        sensors=[CONFIG.sensor_path(rpm) for rpm in CONFIG.records.speeds_rpm],
    output:
        csv=report(f"{R}/tables/table3.csv", caption="../report/table3.rst", category="Link acceleration"),
        md=f"{R}/tables/table3.md",
        lines_csv=report(f"{R}/tables/lines.csv", caption="../report/lines.rst", category="Link acceleration"),
        lines_md=f"{R}/tables/lines.md",
    params:
        runs=SPEEDS,
        speeds=CONFIG.records.speeds_rpm,
        synthetic=CONFIG.sensor_is_synthetic,
        sensor=SENSOR,
    log:
        f"{R}/logs/statistics.log",
    benchmark:
        f"{R}/benchmarks/statistics.tsv"
    message:
        "Table 3"
    script:
        "../scripts/statistics.py"


rule closure:
    """Figure 15: the gap of the loop."""
    input:
        sources("report/style.py", "report/figures/closure.py", "paper/printed.py"),
        recordings=[recording(run) for run in SPEEDS],
    output:
        report(f"{R}/figures/fig15.png", caption="../report/fig15.rst", category="Link acceleration"),
        f"{R}/figures/fig15.svg",
    params:
        speeds=CONFIG.records.speeds_rpm,
    log:
        f"{R}/logs/fig15.log",
    benchmark:
        f"{R}/benchmarks/fig15.tsv"
    message:
        "Figure 15"
    script:
        "../scripts/closure.py"


rule sensor_figures:
    """Figures 17 and 18 of one speed: time histories and spectra beside the sensor's."""
    input:
        MEASURES,
        sources("report/style.py", "report/figures/histories.py", "report/figures/spectra.py", "paper/printed.py"),
        recording=lambda w: recording(SPEEDS["abcdefgh".index(w.letter)]),
        sensor=lambda w: CONFIG.sensor_path(CONFIG.records.speeds_rpm["abcdefgh".index(w.letter)]),
    output:
        history=[
            report(f"{R}/figures/fig17_{{letter}}.png", caption="../report/fig17.rst", category="Link acceleration"),
            f"{R}/figures/fig17_{{letter}}.svg",
        ],
        spectrum=[
            report(f"{R}/figures/fig18_{{letter}}.png", caption="../report/fig18.rst", category="Link acceleration"),
            f"{R}/figures/fig18_{{letter}}.svg",
        ],
    wildcard_constraints:
        letter="[a-h]",
    params:
        synthetic=CONFIG.sensor_is_synthetic,
        sensor=SENSOR,
    log:
        f"{R}/logs/fig17_18_{{letter}}.log",
    benchmark:
        f"{R}/benchmarks/fig17_18_{{letter}}.tsv"
    message:
        "Figures 17 {wildcards.letter} and 18 {wildcards.letter}"
    script:
        "../scripts/sensor_figures.py"


rule loop_figure:
    """The loop on its wheels."""
    input:
        sources("report/style.py", "report/drawing.py", "report/figures/loop.py", "parameters"),
        recording=recording(SPEEDS[0]),
    output:
        report(f"{R}/figures/loop.png", caption="../report/loop.rst", category="Rig and costs"),
        f"{R}/figures/loop.svg",
    log:
        f"{R}/logs/loop.log",
    benchmark:
        f"{R}/benchmarks/loop.tsv"
    message:
        "A picture of the loop"
    script:
        "../scripts/loop_figure.py"


rule records:
    input:
        f"{R}/metrics.csv",
        rules.parameters.output,
        rules.statistics.output,
        rules.closure.output,
        rules.loop_figure.output,
        [
            f"{R}/figures/fig{number}_{letter}.{ending}"
            for number in (17, 18)
            for letter in "abcdefgh"[: len(SPEEDS)]
            for ending in ("png", "svg")
        ],
