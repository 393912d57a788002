# The independent multibody code: Figures 13, 14, Table 2. The runs read no caption: a change of one repeats none.


rule peer_runs:
    """The same loop in Exudyn. Without Exudyn, our side only."""
    input: rig=CONFIG.rig, kernels=KERNELS
    output:
        curves=f"{R}/peers/fig14.csv", summary=f"{R}/peers/summary.csv",
        costs=f"{R}/peers/costs.csv", model=f"{R}/peers/model.json",
    params: options=CONFIG.peers.model_dump()
    priority: 50 # the longest job: it begins early
    script: "../trackdyn_replication/peers/comparison.py"


rule peer:
    """Vertical displacement and computing time of both codes."""
    input: rig=CONFIG.rig, **rules.peer_runs.output
    output: table=f"{R}/tables/table2.csv", figure13=figure("fig13"), figure14=figure("fig14")
    script: "../trackdyn_replication/report/figures/peer.py"
