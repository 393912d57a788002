# Sect. 6: the meshing process (Figures 19 to 22), the ring study (Figures 23, 24).

# slowest speed without a ring and with the paper's, fastest speed with the paper's
SLOWEST, FASTEST = (f"ring/{CONFIG.ring_study.speeds_rpm[end]:g}rpm" for end in (0, -1))
PAPERS_RING = ring_name(CONFIG.records.ring_radius_m)
STABILITY_RUNS = dict.fromkeys([f"{SLOWEST}_none", f"{SLOWEST}_{PAPERS_RING}", f"{FASTEST}_{PAPERS_RING}"])


rule meshing_figures:
    """Figures 19 to 22: forces, areas and screenshots of one passage, without and with the ring."""
    input:
        needs("report/figures/screenshots.py"),
        no_ring=recording("meshing/no_ring"),
        ring=recording("meshing/ring"),
    output: **{name: figure(name) for name in ("fig19", "fig20", "fig21", "fig22")}
    log: f"{R}/logs/meshing_figures.log"
    message: "Figures 19 to 22"
    script: "../replication/report/figures/screenshots.py"


rule ring_figures:
    """Figures 23 and 24: force and duration against the radius."""
    input:
        needs("report/figures/ring_study.py"),
        metrics=f"{R}/measured/ring.csv",
    output: **{name: figure(name) for name in ("fig23_a", "fig23_b", "fig24")}
    log: f"{R}/logs/ring_figures.log"
    message: "Figures 23 and 24"
    script: "../replication/report/figures/ring_study.py"


rule stability_runs:
    """Half the step, twice the record, a later start: what changes."""
    input:
        needs("study/stability.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{R}/stability.csv"
    params:
        scenes=[plain_scene(SCENES[run]) for run in STABILITY_RUNS if run in SCENES],
        known=CONFIG.known.model_dump(),
    log: f"{R}/logs/stability_runs.log"
    message: "Stability of the statistics"
    script: "../replication/study/stability.py"


rule stability:
    input:
        needs("report/stability.py"),
        runs=rules.stability_runs.output[0],
    output: **table("stability")
    log: f"{R}/logs/stability.log"
    message: "Stability of the statistics: the table"
    script: "../replication/report/stability.py"


rule ring:
    input:
        rules.stability.output,
        rules.meshing_figures.output,
        rules.ring_figures.output,
