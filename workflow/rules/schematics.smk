# Figures 1 to 12 and 16: drawings of the geometry and the structure that the simulator uses, no run needed.

# file of trackdyn.report.figures: the figures that it draws
SCHEMATICS = {
    "system": (1, 16),
    "chain_piece": (2,),
    "topology": (3,),
    "locations": (4,),
    "groove": (5, 8),
    "engagement": (6, 7),
    "contact_cases": (9, 10, 12),
    "flow": (11,),
}


rule schematics:
    """Every schematic figure, drawn from the rig in seconds."""
    input:
        sources("parameters", "contact", "chain/model.py", "scene.py"),
        sources("report/style.py", "report/drawing.py", "report/marks.py"),
        sources(*(f"report/figures/{module}.py" for module in SCHEMATICS)),
        rig=CONFIG.rig,
    output:
        [
            f"{R}/figures/fig{number:02d}.{ending}"
            for numbers in SCHEMATICS.values()
            for number in numbers
            for ending in ("png", "svg")
        ],
    params:
        modules=list(SCHEMATICS),
    log:
        f"{R}/logs/schematics.log",
    benchmark:
        f"{R}/benchmarks/schematics.tsv"
    message:
        "Figures 1 to 12 and 16"
    script:
        "../scripts/schematics.py"
