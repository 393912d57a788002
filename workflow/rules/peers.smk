# The independent multibody code instead of the paper's commercial one: Figures 13, 14, Table 2. What runs knows no
# figure and no caption: a change of these runs nothing again.


rule peer_runs:
    """The same loop in Exudyn. Without Exudyn, our side alone."""
    input:
        needs("peers/comparison.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        curves=f"{R}/peers/fig14.csv",
        summary=f"{R}/peers/summary.csv",
        costs=f"{R}/peers/costs.csv",
        model=f"{R}/peers/model.json",
    params: options=CONFIG.peers.model_dump()
    priority: 50 # the longest job: it begins early
    log: f"{R}/logs/peer_runs.log"
    message: "The same loop in an independent code"
    script: "../replication/peers/comparison.py"


rule peer:
    """Vertical displacement and computing time of both codes."""
    input:
        needs("report/figures/peer.py"),
        rig=CONFIG.rig,
        **rules.peer_runs.output,
    output:
        **table("table2", "table"),
        figure13=figure("fig13"),
        figure14=figure("fig14"),
    params: accuracy_pct=CONFIG.peers.accuracy_pct
    log: f"{R}/logs/peer.log"
    message: "Figures 13 and 14 and Table 2"
    script: "../replication/report/figures/peer.py"


rule peer_answers_runs:
    """CPU seconds for an answer of equal error in both codes. Without Exudyn its row says so."""
    input:
        needs("peers/answers.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{R}/peers/answers.csv"
    params: requested=CONFIG.studies.peer_answers.model_dump()
    log: f"{R}/logs/peer_answers_runs.log"
    message: "The same answer in both codes"
    script: "../replication/peers/answers.py"


rule peer_answers:
    input:
        needs("report/answers.py"),
        runs=rules.peer_answers_runs.output[0],
    output: **table("peer_answers")
    params: tolerance=CONFIG.studies.peer_answers.tolerance
    log: f"{R}/logs/peer_answers.log"
    message: "The same answer in both codes: the table"
    script: "../replication/report/answers.py"
