# The scorecard, the drawings, the moving picture, the page that shows everything, and the pictures of the README.


rule claims:
    """Every statement of the paper: met, not met, not comparable."""
    input:
        claims="config/claims.yaml", metrics=f"{R}/metrics.csv", events=f"{R}/events.csv", cells=CONFIG.files["article"],
        peers=[f"{R}/peers/summary.csv"] if CONFIG.peers else [],
        records=[recording(run) for run in SPEEDS + ROUNDED],
    output: csv=f"{R}/claims.csv", sentences=f"{R}/sentences.csv", numbers=f"{R}/printed_numbers.csv"
    params: rpm=CONFIG.meshing.speed_rpm, rounded=CONFIG.rounded_speeds, rig=Path(CONFIG.rig).stem
    script: "../trackdyn_replication/paper/scorecard.py"


rule schematics:
    """Every schematic figure, drawn from the rig in seconds."""
    input: rig=CONFIG.rig
    output: [figure(f"fig{number:02d}") for number in (*range(1, 13), 16)]
    script: "../trackdyn_replication/report/figures/schematics.py"


INTERVAL = 0.01  # s, of the configurations
MOVING_RPM = CONFIG.ring_study.speeds_rpm[0]
MOVING = {
    "motor_rpm": MOVING_RPM,
    "ring_radius": CONFIG.records.ring_radius_m,
    "lead_in": 2.0,
    "step": longest_step(CONFIG.ring_study.steps_s, CONFIG.records.ring_radius_m),
    "frame_interval": INTERVAL,
    # one turn of the sprocket, and the sample that closes it
    "duration": (int(60 * RIG.sprocket.transmission_ratio / MOVING_RPM / INTERVAL) + 1) * INTERVAL,
    "pitches": tuple(range(1, RIG.chain.pitches + 1)),
}


rule animation_run:
    """A short run in steady motion with every pitch recorded."""
    input: rig=CONFIG.rig, kernels=KERNELS
    output: recording("animation")
    params: scenes=[MOVING]
    script: "../trackdyn_replication/pipeline/runs.py"


rule animation:
    """One turn of the sprocket as a GIF."""
    input: ring=rules.animation_run.output[0]
    output: f"{R}/figures/animation.gif"
    script: "../trackdyn_replication/report/figures/animation.py"


# The page waits for the studies that every run has (`default_studies`), and for all if the target `studies` asks for them. Others
# that lie in the results are shown as those of an earlier run.
OF_STUDIES = {name: list(getattr(rules, name).output) for name in STUDIES}
# rules of our own figures and tables, which belong to every run; the study of the ring's tangential force is of the paper's rig
OF_OWN = sorted({item.rule for item in OWN} - {*STUDIES, *([] if CONFIG.is_paper else ["grip_figure"])})


rule page:
    """Page of results: verdicts, figures, tables and their origin."""
    input:
        rules.records.input,
        rules.ring.input,
        rules.claims.output,
        rules.schematics.output,
        rules.peer.output if CONFIG.peers else [],
        [list(getattr(rules, name).output) for name in OF_OWN],
        [*TRACKS.values()] if CONFIG.is_paper else [],
        lambda wildcards: [file for name in requested_studies(wildcards) for file in OF_STUDIES[name]],
    output: f"{R}/report.html"
    params:
        results=R, synthetic=CONFIG.synthetic, studies=requested_studies, short=CONFIG.shorter, teeth=RIG.sprocket.teeth,
        tracks=TRACKS if CONFIG.is_paper else None,
        layers=[below_root(path) for path in workflow.configfiles[:-1]],
    script: "../trackdyn_replication/report/page/builder.py"


# fields in which the recording of a run that ends by a rule (`stop_rule`) differs from the configuration
BY_RULE = {"duration", "lead_in", "frame_interval", "contact_log"}


rule manifest:
    """Hashes of all results, and the numbers of the tables: the reference that another run is verified against."""
    input: rules.page.output, rules.animation.output, inputs=RUN_INPUTS, rig=CONFIG.rig
    output: f"{R}/manifest.json"
    params:
        runs={
            f"runs/{name}.npz": scene.model_dump(
                mode="json", exclude={"rig", *(BY_RULE if name.startswith("ring/") else ())}
            )
            for name, scene in SCENES.items()
        },
    script: "../trackdyn_replication/certify.py"


rule studies:
    """Every study, and the page with them; asked for by name."""
    input: list(OF_STUDIES.values()), rules.manifest.output


rule pictures:
    """Pictures and measured parts of the pages from the present results. Asked for by name: they stand in version control."""
    input:
        tables=[f"{R}/{name}.csv" for name in ("claims", "sentences", "printed_numbers", "tables/parameters")],
        trade=[f"{R}/{name}.csv" for name in ("trade", "planner")],
        by_name=[f"{R}/{name}.csv" for name in ("default_step", "step_errors", "tables/fidelity")],
        manifest=f"{R}/manifest.json",
        pictures=[
            f"{R}/figures/{name}" for name in ("animation.gif", "fig19.png", "fig24.png", "grip.png", "trade.png")
        ],
    log: f"{R}/logs/pictures.log"
    shell:
        "{sys.executable:q} -m trackdyn_replication.report.filled {input.tables:q} {input.trade:q} {input.by_name:q} {input.pictures:q}"
        " > {log:q} 2>&1"
