# The independent multibody code in the place of the paper's commercial one: Figures 13, 14, Table 2.


rule peer:
    """The same loop in Exudyn: vertical displacement and computing time. Without Exudyn, our side alone."""
    input:
        needs("peer.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        **table("table2", "table"),
        curves=f"{R}/peers/fig14.csv",
        summary=f"{R}/peers/summary.csv",
        model=figure("fig13"),
        displacement=figure("fig14"),
    params: options=CONFIG.peers.model_dump()
    priority: 50 # the longest job: it begins early
    log: f"{R}/logs/peer.log"
    message: "Figures 13 and 14 and Table 2: the same loop in an independent code"
    script: "../scripts/peer.py"


rule peer_answers:
    """CPU seconds for an answer of equal error in every code. One that is missing has a row that says so."""
    input:
        needs("peer_answers.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: **table("peer_answers")
    params: asked=CONFIG.studies.peer_answers.model_dump()
    log: f"{R}/logs/peer_answers.log"
    message: "The same answer in every code"
    script: "../scripts/peer_answers.py"
