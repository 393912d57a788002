# The independent multibody code in the place of the paper's commercial one: Figures 13, 14, Table 2.


rule peer:
    """The same loop in Exudyn: vertical displacement and computing time. Without Exudyn, our side alone."""
    input:
        SIMULATOR,
        sources("peers", "report/style.py", "report/drawing.py", "paper/printed.py", "report/tables.py"),
        sources("report/figures/peer.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        curves=f"{R}/peers/fig14.csv",
        summary=f"{R}/peers/summary.csv",
        table=f"{R}/tables/table2.csv",
        table_md=f"{R}/tables/table2.md",
        model=multiext(f"{R}/figures/fig13", ".png", ".svg"),
        displacement=multiext(f"{R}/figures/fig14", ".png", ".svg"),
    params:
        options=CONFIG.peers.model_dump(),
    log:
        f"{R}/logs/peer.log",
    benchmark:
        f"{R}/benchmarks/peer.tsv"
    message:
        "Figures 13 and 14 and Table 2: the same loop in an independent code"
    script:
        "../scripts/peer.py"


rule peers:
    input:
        rules.peer.output,
