# The scorecard, the sensitivity of the fitted rig, and the fit itself (not part of the default target).


rule claims:
    """Every claim of the paper: reproduced, in trend, not reproduced, not comparable."""
    input:
        needs("claims.py"),
        claims="config/claims.yaml",
        metrics=f"{R}/metrics.csv",
        events=f"{R}/events.csv",
        peer=f"{R}/peers/summary.csv",
        costs=f"{R}/tables/table2.csv",
        tables=ARTICLE,
        records=[recording(run) for run in SPEEDS],
        others=[f"{R}/rigs/{other}/{name}.csv" for other in OTHERS for name in ("metrics", "events")],
    output:
        csv=f"{R}/claims.csv",
        values=f"{R}/claims_values.csv",
        schema=f"{R}/claims.schema.json",
        values_schema=f"{R}/claims_values.schema.json",
        md=f"{R}/claims.md",
        figure=figure("claims"),
    params:
        rpm=CONFIG.meshing.speed_rpm,
        radius=CONFIG.meshing.ring_radius_m,
        seconds=CONFIG.records.duration_s,
        rigs={other: f"{R}/rigs/{other}" for other in OTHERS},
    log: f"{R}/logs/claims.log"
    message: "Judging the claims"
    script: "../scripts/claims.py"


# rings, or none, in which the sensitivity is taken
CASES = CONFIG.fit_cases()


rule sensitivity_case:
    """One case of the fit for the rig as it is, with every fitted parameter moved, and with other equal pitches."""
    input:
        needs("sensitivity_case.py"),
        rig=POSSIBLE,
        fit="config/fit.yaml",
        kernels=KERNELS,
    output: f"{R}/sensitivity/{{ring}}.csv"
    params:
        radius=lambda wildcards: CASES[wildcards.ring],
        step=lambda wildcards: allowed_step(CONFIG.ring_study.steps_s, CASES[wildcards.ring]),
        known=CONFIG.known.model_dump(),
    log: f"{R}/logs/sensitivity/{{ring}}.log"
    message: "Sensitivity with the ring {wildcards.ring}"
    script: "../scripts/sensitivity_case.py"


rule sensitivity:
    """What moves when a fitted parameter moves."""
    input:
        needs("sensitivity.py"),
        rig=POSSIBLE,
        fit="config/fit.yaml",
        kernels=KERNELS,
        cases=[f"{R}/sensitivity/{ring}.csv" for ring in CASES],
    output:
        **table("sensitivity"),
        **table("fit_targets", "targets"),
        **table("equal_pitch", "readings"),
        **table("run_direction", "directions"),
        figure=figure("sensitivity"),
    params:
        radii=CONFIG.sensitivity.radii_m,
        without_ring=CONFIG.sensitivity.without_ring,
        step=allowed_step(CONFIG.ring_study.steps_s, RIG.sprocket.ring_radius),
        known=CONFIG.known.model_dump(),
    log: f"{R}/logs/sensitivity.log"
    message: "Sensitivity of the contact measures to every fitted parameter"
    script: "../scripts/sensitivity.py"


rule fit_form:
    """Fit the rig to the targets of config/fit.yaml from many starts; rows are kept, so that a fit goes on where it was."""
    input:
        needs("fit.py"),
        rig=POSSIBLE,
        fit="config/fit.yaml",
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output:
        starts=f"{R}/{{short}}fit/starts.csv",
        values=f"{R}/{{short}}fit/values.csv",
        targets=f"{R}/{{short}}fit/targets.csv",
    params:
        form=form_name,
        store=f"{R}/fit/rows",
    threads: 2
    log: f"{R}/logs/{{short}}fit.log"
    message: "Fitting the rig"
    script: "../scripts/fit.py"


rule fit:
    """The fit in full (an hour on two cores; ask for it by name)."""
    input:
        f"{R}/fit/starts.csv",
