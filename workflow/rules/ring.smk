# Sect. 6: the meshing process (Figures 19 to 22), the ring study (Figures 23, 24), Table 4.

# slowest speed without a ring and with the paper's, fastest speed with the paper's
SLOWEST, FASTEST = (f"ring/{CONFIG.ring_study.speeds_rpm[end]:g}rpm" for end in (0, -1))
PAPERS_RING = ring_name(CONFIG.records.ring_radius_m)
STABILITY_RUNS = [f"{SLOWEST}_none", f"{SLOWEST}_{PAPERS_RING}", f"{FASTEST}_{PAPERS_RING}"]


rule events:
    """Contact spells of the meshing process, and the times of the events of C16 and C17."""
    input:
        needs("events.py"),
        recordings=[recording("meshing/no_ring"), recording("meshing/ring")],
    output:
        events=f"{R}/events.csv",
        schema=f"{R}/events.schema.json",
        spells=f"{R}/spells.csv",
    log: f"{R}/logs/events.log"
    message: "Events of the meshing process"
    script: "../scripts/events.py"


use rule events as events_other with:
    input:
        needs("events.py"),
        recordings=[f"{R}/rigs/{{other}}/runs/meshing/{name}.npz" for name in ("no_ring", "ring")],
    output:
        events=f"{R}/rigs/{{other}}/events.csv",
        schema=f"{R}/rigs/{{other}}/events.schema.json",
        spells=f"{R}/rigs/{{other}}/spells.csv",
    log: f"{R}/logs/rigs/{{other}}/events.log"


rule meshing_figures:
    """Figures 19 to 22: forces, areas and screenshots of one passage, without and with the ring."""
    input:
        needs("meshing_figures.py"),
        no_ring=recording("meshing/no_ring"),
        ring=recording("meshing/ring"),
    output: **{name: figure(name) for name in ("fig19", "fig20", "fig21", "fig22")}
    log: f"{R}/logs/meshing_figures.log"
    message: "Figures 19 to 22"
    script: "../scripts/meshing_figures.py"


rule ring_figures:
    """Figures 23 and 24: force and duration against the radius."""
    input:
        needs("ring_figures.py"),
        metrics=f"{R}/metrics.csv",
    output:
        rms=figure("fig23_a"),
        sd=figure("fig23_b"),
        duration=figure("fig24"),
    log: f"{R}/logs/ring_figures.log"
    message: "Figures 23 and 24"
    script: "../scripts/ring_figures.py"


rule coarse_table:
    """Table 4: what the coarser tooth contact changes."""
    input:
        needs("coarse_table.py"),
        metrics=f"{R}/metrics.csv",
    output: **table("table4")
    params: speeds=CONFIG.records.speeds_rpm
    log: f"{R}/logs/table4.log"
    message: "Table 4"
    script: "../scripts/coarse_table.py"


rule stability_runs:
    """Half the step, twice the record, a later start: what changes."""
    input:
        needs("stability_runs.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{R}/stability.csv"
    params:
        scenes=[plain_scene(SCENES[run]) for run in STABILITY_RUNS if run in SCENES],
        known=CONFIG.known.model_dump(),
    log: f"{R}/logs/stability_runs.log"
    message: "Stability of the statistics"
    script: "../scripts/stability_runs.py"


rule stability:
    input:
        needs("stability.py"),
        rules.stability_runs.output,
    output: **table("stability")
    log: f"{R}/logs/stability.log"
    message: "Stability of the statistics: the table"
    script: "../scripts/stability.py"


rule ring:
    input:
        rules.stability.output,
        rules.meshing_figures.output,
        rules.ring_figures.output,
        rules.coarse_table.output,
