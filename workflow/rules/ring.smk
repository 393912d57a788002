# Sect. 6: the meshing process (Figures 19 to 22), the ring study (Figures 23, 24), Table 4.


rule events:
    """Contact spells of the meshing process, and the times of the events of C16 and C17."""
    input:
        MEASURES,
        recordings=[recording("meshing/no_ring"), recording("meshing/ring")],
    output:
        events=f"{R}/events.csv",
        spells=f"{R}/spells.csv",
    log:
        f"{R}/logs/events.log",
    benchmark:
        f"{R}/benchmarks/events.tsv"
    message:
        "Events of the meshing process"
    script:
        "../scripts/events.py"


rule meshing_figures:
    """Figures 19 to 22: forces, areas and screenshots of one passage, without and with the ring."""
    input:
        MEASURES,
        sources("report/style.py", "report/drawing.py", "paper/printed.py", "report/figures/meshing.py"),
        sources("report/figures/screenshots.py"),
        no_ring=recording("meshing/no_ring"),
        ring=recording("meshing/ring"),
    output:
        report(f"{R}/figures/fig19.png", caption="../report/fig19.rst", category="Contact"),
        f"{R}/figures/fig19.svg",
        report(f"{R}/figures/fig20.png", caption="../report/fig20.rst", category="Contact"),
        f"{R}/figures/fig20.svg",
        report(f"{R}/figures/fig21.png", caption="../report/fig21.rst", category="Contact"),
        f"{R}/figures/fig21.svg",
        report(f"{R}/figures/fig22.png", caption="../report/fig22.rst", category="Contact"),
        f"{R}/figures/fig22.svg",
    log:
        f"{R}/logs/meshing_figures.log",
    benchmark:
        f"{R}/benchmarks/meshing_figures.tsv"
    message:
        "Figures 19 to 22"
    script:
        "../scripts/meshing_figures.py"


rule ring_figures:
    """Figures 23 and 24: force and duration against the radius."""
    input:
        sources("report/style.py", "report/figures/ring_study.py"),
        metrics=f"{R}/metrics.csv",
    output:
        report(f"{R}/figures/fig23_a.png", caption="../report/fig23.rst", category="Contact"),
        f"{R}/figures/fig23_a.svg",
        report(f"{R}/figures/fig23_b.png", caption="../report/fig23.rst", category="Contact"),
        f"{R}/figures/fig23_b.svg",
        report(f"{R}/figures/fig24.png", caption="../report/fig24.rst", category="Contact"),
        f"{R}/figures/fig24.svg",
    log:
        f"{R}/logs/ring_figures.log",
    benchmark:
        f"{R}/benchmarks/ring_figures.tsv"
    message:
        "Figures 23 and 24"
    script:
        "../scripts/ring_figures.py"


rule coarse_table:
    """Table 4: what the coarser tooth contact changes."""
    input:
        sources("report/tables.py", "paper/printed.py"),
        metrics=f"{R}/metrics.csv",
    output:
        csv=report(f"{R}/tables/table4.csv", caption="../report/table4.rst", category="Link acceleration"),
        md=f"{R}/tables/table4.md",
    params:
        speeds=CONFIG.records.speeds_rpm,
    log:
        f"{R}/logs/table4.log",
    benchmark:
        f"{R}/benchmarks/table4.tsv"
    message:
        "Table 4"
    script:
        "../scripts/coarse_table.py"


rule stability:
    """Half the step, twice the record, a later start: what changes."""
    input:
        SIMULATOR,
        MEASURES,
        sources("study/stability.py", "report/tables.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        csv=report(f"{R}/tables/stability.csv", caption="../report/stability.rst", category="Contact"),
        md=f"{R}/tables/stability.md",
    params:
        scenes=[plain_scene(run) for run in STABILITY_RUNS],
    log:
        f"{R}/logs/stability.log",
    benchmark:
        f"{R}/benchmarks/stability.tsv"
    message:
        "Stability of the statistics"
    script:
        "../scripts/stability.py"


rule ring:
    input:
        rules.stability.output,
        rules.meshing_figures.output,
        rules.ring_figures.output,
        rules.coarse_table.output,
