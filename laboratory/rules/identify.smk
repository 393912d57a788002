# How sure `trackdyn identify` is of what it says: both are asked for by name.

# whose values the parts can have: the ranges begin there
PARTS_RIG = "config/rigs/parts.yaml"

rule calibration:
    """Truths drawn from the prior, and how often the intervals hold them. What was simulated is kept in between."""
    input:
        PARTS_RIG,
        config="config/calibration.yaml",
        kernels=KERNELS,
    output:
        ranks=f"{L}/identify/ranks.csv",
        summary=f"{L}/tables/calibration.csv",
    params: store=f"{L}/identify/calibration_rows"
    threads: 64 # that is, all there are
    log: f"{L}/logs/calibration.log"
    script: "../inference/identification/calibration.py"


rule identify_synthetic:
    """The synthetic records, which no rig made: what an identification says of them."""
    input:
        rig=PARTS_RIG,
        config="config/calibration.yaml",
        kernels=KERNELS,
        records=[f"data/synthetic/{rpm}rpm.csv" for rpm in (115, 210)], # the speeds of the calibration
    output:
        page=f"{L}/identify/synthetic/index.html",
        short=f"{L}/identify/synthetic/in_short.csv",
    params: store=f"{L}/identify/calibration_rows" # whose simulations serve here, too
    threads: 64 # that is, all there are
    log: f"{L}/logs/identify_synthetic.log"
    script: "../report/identification.py"
