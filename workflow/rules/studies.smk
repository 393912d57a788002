# What accuracy costs: the ladder of fidelities, work-precision data, the planner. `trade` is asked for by
# name; a short form of it belongs to the default target. Costs are processor time: jobs may run side by side.

TRADE_FIGURES = ("state", "rms", "left_share", "answer", "planner")


# settings of the ladder whose method is not the standard one
LADDER_KERNELS = {
    setting: method_kernels(fields["integrator"])
    for setting, fields in SETTINGS.items()
    if fields.get("integrator", "semi_implicit") != "semi_implicit"
}


rule fidelity_setting:
    """One setting of the ladder at every speed, with and without the ring."""
    input:
        needs("fidelity_setting.py"),
        rig=CONFIG.rig,
        kernels=lambda wildcards: LADDER_KERNELS.get(wildcards.setting, KERNELS),
    output: f"{R}/fidelity/{{setting}}.csv"
    params:
        speeds=CONFIG.fidelity.speeds_rpm,
        radii=CONFIG.ladder_radii,
        known=CONFIG.known.model_dump(),
    wildcard_constraints: setting=r"\w+=\w+"
    priority: 40
    log: f"{R}/logs/fidelity/{{setting}}.log"
    message: "The ladder of fidelities: {wildcards.setting}"
    script: "../scripts/fidelity_setting.py"


rule fidelity:
    """Every setting of the ladder against the paper's fidelity: difference and cost."""
    input:
        needs("fidelity.py"),
        settings=[f"{R}/fidelity/{setting}.csv" for setting in CONFIG.ladder_settings],
    output:
        csv=f"{R}/fidelity.csv",
        md=f"{R}/tables/fidelity.md",
        wide=f"{R}/tables/fidelity.csv",
    log: f"{R}/logs/fidelity.log"
    message: "The ladder of fidelities"
    script: "../scripts/fidelity.py"


TRADE_FORMS = {"full": CONFIG.studies.trade.full, "short": CONFIG.studies.trade.short}
FOLDERS = {"full": R, "short": f"{R}/short"}
# names of what is measured, and their files
TRADE_DATA = {"trade": "trade", "agreement": "trade_references", "limits": "trade_limits"}


def trade_outputs(folder):
    return dict(
        planner=f"{folder}/planner.csv",
        limits=f"{folder}/tables/limits.csv",
        limits_md=f"{folder}/tables/limits.md",
        summary=f"{folder}/tables/trade.md",
        figures=[f"{folder}/figures/trade_{name}.png" for name in TRADE_FIGURES],
        vectors=[f"{folder}/figures/trade_{name}.svg" for name in TRADE_FIGURES],
    )


def trade_inputs(form):
    """What the study is made of: data, references and limits, and the planner's promises for each scene kept apart."""
    folder, apart = FOLDERS[form], promised_scenes(TRADE_FORMS[form])
    data = {name: f"{folder}/{file}.csv" for name, file in TRADE_DATA.items()}
    return data | dict(promises=[f"{R}/trade/{form}/promises_{name}.csv" for name in apart])


rule trade_scene:
    """Work-precision data of one scene."""
    input:
        needs("trade_scene.py"),
        rig=CONFIG.rig,
        kernels=SEVERAL_METHODS,
    output: **{name: f"{R}/trade/{{form}}/{name}_{{part}}.csv" for name in TRADE_DATA}
    params: form=lambda wildcards: TRADE_FORMS[wildcards.form].model_dump()
    wildcard_constraints: form="full|short"
    priority: 40 # data, promises and the study wait for it
    log: f"{R}/logs/trade_{{form}}/{{part}}.log"
    message: "Accuracy against cost, {wildcards.form}: {wildcards.part}"
    script: "../scripts/trade_scene.py"


rule trade_data:
    """Work-precision data of all scenes."""
    input:
        needs("trade_data.py"),
        **{name: [f"{R}/trade/full/{name}_{part}.csv" for part in measured_scenes(TRADE_FORMS["full"])] for name in TRADE_DATA},
    output: **{name: f"{R}/{file}.csv" for name, file in TRADE_DATA.items()}
    log: f"{R}/logs/trade_full/data.log"
    message: "Accuracy against cost: the data"
    script: "../scripts/trade_data.py"


use rule trade_data as trade_data_short with:
    input:
        needs("trade_data.py"),
        **{name: [f"{R}/trade/short/{name}_{part}.csv" for part in measured_scenes(TRADE_FORMS["short"])] for name in TRADE_DATA},
    output: **{name: f"{R}/short/{file}.csv" for name, file in TRADE_DATA.items()}
    log: f"{R}/logs/trade_short/data.log"


rule trade_promises:
    """The planner on one scene kept apart."""
    input:
        needs("trade_promises.py"),
        rig=CONFIG.rig,
        kernels=SEVERAL_METHODS,
        trade=lambda wildcards: f"{FOLDERS[wildcards.form]}/trade.csv",
    output: f"{R}/trade/{{form}}/promises_{{part}}.csv"
    params: form=lambda wildcards: TRADE_FORMS[wildcards.form].model_dump()
    wildcard_constraints: form="full|short"
    priority: 40
    log: f"{R}/logs/trade_{{form}}/promises_{{part}}.log"
    message: "The planner, {wildcards.form}: {wildcards.part}"
    script: "../scripts/trade_promises.py"


rule trade:
    """Work-precision data, limits over steps, the planner on scenes kept apart. Costs are processor time: others may run beside."""
    input:
        needs("trade.py"),
        **trade_inputs("full"),
    output: **trade_outputs(R)
    log: f"{R}/logs/trade.log"
    message: "Accuracy against cost"
    script: "../scripts/trade.py"


use rule trade as trade_short with:
    input:
        needs("trade.py"),
        **trade_inputs("short"),
    output: **trade_outputs(f"{R}/short")
    log: f"{R}/logs/trade_short.log"
    message: "Accuracy against cost, the short form"


rule scaling:
    """A sweep of equal runs on one process and on two."""
    input:
        needs("scaling.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        csv=f"{R}/scaling.csv",
        figure=figure("scaling"),
    params:
        runs=CONFIG.studies.trade.full.scaling_runs,
        seconds=CONFIG.studies.trade.full.scaling_s,
    # measured by the clock on the wall: nothing else of the pipeline may run beside
    threads: 64 # that is, all there are
    priority: 90 # alone, and therefore before the others
    log: f"{R}/logs/scaling.log"
    message: "A sweep on one process and on two"
    script: "../scripts/scaling.py"


use rule scaling as scaling_short with:
    output:
        csv=f"{R}/short/scaling.csv",
        figure=[f"{R}/short/figures/scaling.{ending}" for ending in ("png", "svg")],
    params:
        runs=CONFIG.studies.trade.short.scaling_runs,
        seconds=CONFIG.studies.trade.short.scaling_s,
    log: f"{R}/logs/scaling_short.log"
    message: "A sweep on one process and on two, the short form"


rule traction:
    """Which flank carries drive, over creep slope and radius of the ring (asked for by name, a minute or two)."""
    input:
        needs("traction.py"),
        rig=CONFIG.rig,
        kernels=method_kernels("linearly_implicit"),
    output:
        csv=f"{R}/traction.csv",
        figure=figure("traction"),
    params: form=CONFIG.studies.traction.full.model_dump()
    log: f"{R}/logs/traction.log"
    message: "Traction of the ring"
    script: "../scripts/traction.py"


use rule traction as traction_short with:
    output:
        csv=f"{R}/short/traction.csv",
        figure=[f"{R}/short/figures/traction.{ending}" for ending in ("png", "svg")],
    params: form=CONFIG.studies.traction.short.model_dump()
    log: f"{R}/logs/traction_short.log"


rule deviations:
    """What each departure from the paper changes (docs/deviations.md); asked for by name, some minutes."""
    input:
        needs("deviations.py"),
        rig=CONFIG.rig,
        study="config/departures.yaml",
        kernels=KERNELS,
    output: f"{R}/deviations.csv"
    log: f"{R}/logs/deviations.log"
    message: "What the departures change"
    script: "../scripts/deviations.py"


rule whole_loop:
    """Short answers of the whole loop beside records of twenty revolutions (asked for by name, some minutes)."""
    input:
        needs("whole_loop.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: f"{R}/whole_loop.csv"
    params:
        form=CONFIG.studies.whole_loop.full.model_dump(),
        steps=CONFIG.ring_study.steps_s,
    log: f"{R}/logs/whole_loop.log"
    message: "Short answers beside long ones"
    script: "../scripts/whole_loop.py"


use rule whole_loop as whole_loop_short with:
    output: f"{R}/short/whole_loop.csv"
    params:
        form=CONFIG.studies.whole_loop.short.model_dump(),
        steps=CONFIG.ring_study.steps_s,
    log: f"{R}/logs/whole_loop_short.log"
