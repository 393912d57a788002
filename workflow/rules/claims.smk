# The scorecard, the sensitivity of the fitted rig, and the fit itself (not part of the default target).


rule claims:
    """Every claim of the paper: reproduced, in trend, not reproduced, not comparable."""
    input:
        MEASURES,
        sources("paper", "report/figures/scorecard.py", "report/style.py", "report/tables.py"),
        claims="config/claims.yaml",
        metrics=f"{R}/metrics.csv",
        events=f"{R}/events.csv",
        peer=f"{R}/peers/summary.csv",
        records=[recording(run) for run in SPEEDS],
    output:
        csv=report(f"{R}/claims.csv", caption="../report/claims.rst", category="Claims"),
        md=f"{R}/claims.md",
        figure=[
            report(f"{R}/figures/claims.png", caption="../report/claims.rst", category="Claims"),
            f"{R}/figures/claims.svg",
        ],
    params:
        rpm=CONFIG.meshing.speed_rpm,
        radius=CONFIG.meshing.ring_radius_m,
        seconds=CONFIG.records.duration_s,
    log:
        f"{R}/logs/claims.log",
    benchmark:
        f"{R}/benchmarks/claims.tsv"
    message:
        "Judging the claims"
    script:
        "../scripts/claims.py"


rule sensitivity:
    """What moves when a fitted parameter moves."""
    input:
        SIMULATOR,
        MEASURES,
        sources("fit.py", "config.py", "report/figures/sensitivity.py", "report/tables.py", "report/style.py"),
        rig=CONFIG.rig,
        fit="config/fit.yaml",
        kernels=KERNELS,
    output:
        csv=report(f"{R}/tables/sensitivity.csv", caption="../report/sensitivity.rst", category="Claims"),
        md=f"{R}/tables/sensitivity.md",
        targets=report(f"{R}/tables/fit_targets.csv", caption="../report/fit_targets.rst", category="Claims"),
        targets_md=f"{R}/tables/fit_targets.md",
        readings=report(f"{R}/tables/equal_pitch.csv", caption="../report/equal_pitch.rst", category="Claims"),
        readings_md=f"{R}/tables/equal_pitch.md",
        directions=report(f"{R}/tables/run_direction.csv", caption="../report/run_direction.rst", category="Claims"),
        directions_md=f"{R}/tables/run_direction.md",
        figure=[
            report(f"{R}/figures/sensitivity.png", caption="../report/sensitivity.rst", category="Claims"),
            f"{R}/figures/sensitivity.svg",
        ],
    params:
        radii=CONFIG.sensitivity.radii_m,
        without_ring=CONFIG.sensitivity.without_ring,
    log:
        f"{R}/logs/sensitivity.log",
    benchmark:
        f"{R}/benchmarks/sensitivity.tsv"
    message:
        "Sensitivity of the contact measures to every fitted parameter"
    script:
        "../scripts/sensitivity.py"


rule fit:
    """Fit the rig to the targets of config/fit.yaml (ten minutes; ask for it by name)."""
    input:
        SIMULATOR,
        MEASURES,
        sources("fit.py", "config.py"),
        rig=CONFIG.rig,
        fit="config/fit.yaml",
        kernels=KERNELS,
    output:
        values=f"{R}/fit/values.csv",
        history=f"{R}/fit/history.csv",
        targets=f"{R}/fit/targets.csv",
    threads: 2
    log:
        f"{R}/logs/fit.log",
    benchmark:
        f"{R}/benchmarks/fit.tsv"
    message:
        "Fitting the rig"
    script:
        "../scripts/fit.py"


rule costs:
    """What each rule cost, from the benchmark files."""
    input:
        f"{R}/metrics.csv",
        rules.records.input,
        rules.ring.input,
        rules.claims.output,
        rules.sensitivity.output,
    output:
        csv=report(f"{R}/tables/costs.csv", caption="../report/costs.rst", category="Rig and costs"),
        md=f"{R}/tables/costs.md",
    params:
        folder=f"{R}/benchmarks",
    log:
        f"{R}/logs/costs.log",
    benchmark:
        f"{R}/benchmarks/costs.tsv"
    message:
        "Costs"
    script:
        "../scripts/costs.py"
