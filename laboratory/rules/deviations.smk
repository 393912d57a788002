# What each departure from the paper changes.


rule deviations:
    """What each departure from the paper changes (docs/deviations.md); asked for by name, some minutes."""
    input:
        needs("study/departures.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{L}/deviations.csv"
    log: f"{L}/logs/deviations.log"
    message: "What the departures change"
    script: "../../workflow/replication/study/departures.py"
