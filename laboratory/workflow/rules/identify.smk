# How sure `trackdyn identify` is of what it says: both are asked for by name.

rule calibration:
    """Truths drawn from the prior, and how often the intervals hold them. What was simulated is kept in between."""
    input:
        needs("calibration.py"),
        POSSIBLE,
        config="config/calibration.yaml",
        kernels=KERNELS,
    output:
        csv=f"{R}/identify/calibration.csv",
        ranks=f"{R}/identify/ranks.csv",
        figures=[f"{R}/identify/calibration.{ending}" for ending in ("png", "svg")],
        rank_figures=[f"{R}/identify/ranks.{ending}" for ending in ("png", "svg")],
        **table("calibration", "summary"),
        **table("repeated_records", "repeated"),
    params: store=f"{R}/identify/calibration_rows"
    threads: 64 # that is, all there are
    log: f"{R}/logs/calibration.log"
    message: "Calibration of the identification: truths from the prior"
    script: "../scripts/calibration.py"


rule identify_synthetic:
    """The synthetic records, which no rig made: what an identification says of them."""
    input:
        needs("identify_synthetic.py"),
        rig=POSSIBLE,
        config="config/calibration.yaml",
        kernels=KERNELS,
        records=[f"data/synthetic/{rpm}rpm.csv" for rpm in (115, 210)], # the speeds of the calibration
    output:
        page=f"{R}/identify/synthetic/index.html",
        short=f"{R}/identify/synthetic/in_short.csv",
    params: store=f"{R}/identify/calibration_rows" # whose simulations serve here, too
    threads: 64 # that is, all there are
    log: f"{R}/logs/identify_synthetic.log"
    message: "Identification from the synthetic records"
    script: "../scripts/identify_synthetic.py"
