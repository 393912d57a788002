# Cost of accuracy: the ladder of fidelities, work-precision data, the planner. Costs are CPU time: jobs may run side by side.


rule fidelity_setting:
    """One setting of the ladder at every speed, with and without the ring."""
    input: rig=CONFIG.rig, kernels=lambda wildcards: scene_kernels(SETTINGS[wildcards.setting].scene)
    output: f"{R}/fidelity/{{setting}}.csv"
    params: speeds=CONFIG.fidelity.speeds_rpm, radii=CONFIG.ladder_radii, stop_rule=CONFIG.stop_rule.model_dump()
    wildcard_constraints: setting=r"[\w.]+=[\w.-]+"
    priority: 40
    message: "The ladder of fidelities: {wildcards.setting}"
    script: "../trackdyn_replication/study/accuracy/ladder.py"


rule fidelity:
    """Every setting of the ladder against the paper's fidelity: difference and cost."""
    input: settings=[f"{R}/fidelity/{setting}.csv" for setting in CONFIG.ladder_settings]
    output: csv=f"{R}/fidelity.csv", wide=f"{R}/tables/fidelity.csv"
    script: "../trackdyn_replication/report/fidelity.py"


rule trade_scene:
    """Work-precision data of one scene."""
    input: rig=CONFIG.rig, kernels=[*SEVERAL_METHODS, method_kernels("spatial")]
    output: f"{R}/trade/trade_{{scenes}}.csv"
    params: study=CONFIG.studies.trade.model_dump()
    priority: 40 # data, promises and the study wait for it
    message: "Accuracy against cost: {wildcards.scenes}"
    script: "../trackdyn_replication/study/accuracy/trade.py"


rule trade_promises:
    """The planner on one scene kept apart."""
    input: rig=CONFIG.rig, kernels=SEVERAL_METHODS
    output: f"{R}/trade/promises_{{scenes}}.csv"
    params: study=CONFIG.studies.trade.model_dump()
    priority: 40
    message: "The planner: {wildcards.scenes}"
    script: "../trackdyn_replication/study/accuracy/promises.py"


rule trade:
    """Data, and the planner on scenes kept apart. Costs are CPU time: others may run at the same time."""
    input:
        parts=[f"{R}/trade/trade_{name}.csv" for name in measured_scenes(CONFIG.studies.trade)],
        promises=[f"{R}/trade/promises_{name}.csv" for name in promised_scenes(CONFIG.studies.trade)],
    output: csv=f"{R}/trade.csv", planner=f"{R}/planner.csv", figure=figure("trade")
    script: "../trackdyn_replication/report/figures/trade.py"


rule default_step:
    """Every included rig at its default step against its limits, by name: some minutes."""
    input:
        rigs=sorted(str(path.relative_to(ROOT)) for path in (ROOT / "trackdyn" / "rigs").glob("*.yaml")),
        kernels=KERNELS,
    output: rows=f"{R}/default_step.csv", table=f"{R}/step_errors.csv"
    script: "../trackdyn_replication/study/accuracy/default_step.py"
