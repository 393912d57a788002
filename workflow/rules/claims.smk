# The scorecard.


rule claims:
    """Every statement of the paper: met, not met, not comparable."""
    input:
        claims="config/claims.yaml",
        metrics=f"{R}/metrics.csv",
        events=f"{R}/events.csv",
        peers=[f"{R}/peers/summary.csv"] if CONFIG.peers else [],
        cells=CONFIG.files["article"],
        records=[recording(run) for run in SPEEDS + ROUNDED],
    output: csv=f"{R}/claims.csv", sentences=f"{R}/sentences.csv", numbers=f"{R}/printed_numbers.csv"
    params: rpm=CONFIG.meshing.speed_rpm, rounded=CONFIG.rounded_speeds, rig=Path(CONFIG.rig).stem
    script: "../trackdyn_replication/paper/scorecard.py"
