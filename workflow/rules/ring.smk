# Sect. 6: the meshing process (Figures 19 to 22), the ring study (Figures 23, 24).


rule meshing_figures:
    """Figures 19 to 22: forces, areas and screenshots of one passage, without and with the ring."""
    input: no_ring=recording("meshing/no_ring"), ring=recording("meshing/ring")
    output: **{name: figure(name) for name in ("fig19", "fig20", "fig21", "fig22")}
    script: "../trackdyn_replication/report/figures/meshing.py"


rule ring_figures:
    """Figures 23 and 24: force and duration against the radius; for the paper's rig also durations with a ring that grips."""
    input: metrics=f"{R}/measured/ring.csv", grips=[GRIPS["ring"]] if CONFIG.is_paper else []
    output: **{name: figure(name) for name in ("fig23_a", "fig23_b", "fig24", *(["creep"] if CONFIG.is_paper else []))}
    script: "../trackdyn_replication/report/figures/ring_study.py"


rule grip_figure:
    """Effect of the ring's tangential force: window of radii, and shares of tracks by two laws of friction."""
    input: table=GRIP, rig="trackdyn/rigs/paper.yaml"
    output: figure("grip")
    script: "../trackdyn_replication/report/figures/ring_study.py"


rule ring:
    input: rules.meshing_figures.output, rules.ring_figures.output, rules.grip_figure.output if CONFIG.is_paper else []
