# What each departure from the paper changes.


rule deviations:
    """What each departure from the paper changes (docs/deviations.md); asked for by name, some minutes."""
    input:
        lab_needs("deviations.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{L}/deviations.csv"
    log: f"{L}/logs/deviations.log"
    message: "What the departures change"
    script: "../scripts/deviations.py"
