# Figures 1 to 12 and 16: drawings of the geometry and the structure that the simulator uses, no run needed.


rule schematics:
    """Every schematic figure, drawn from the rig in seconds."""
    input: rig=CONFIG.rig
    output: [figure(f"fig{number:02d}") for number in (*range(1, 13), 16)]
    script: "../trackdyn_replication/report/figures/schematics.py"
