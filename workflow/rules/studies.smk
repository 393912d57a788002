# What accuracy costs: the ladder of fidelities, work-precision data, the planner. `trade` is asked for by
# name; a short form of it belongs to the default target.

TRADE_FIGURES = ("state", "rms", "left_share", "answer", "planner")


rule fidelity:
    """Every setting of the ladder against the paper's fidelity: difference and cost."""
    input:
        needs("fidelity.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        csv=f"{R}/fidelity.csv",
        md=f"{R}/tables/fidelity.md",
        wide=f"{R}/tables/fidelity.csv",
    params:
        study=CONFIG.fidelity.model_dump(),
        radius=CONFIG.records.ring_radius_m,
    log: f"{R}/logs/fidelity.log"
    benchmark: f"{R}/benchmarks/fidelity.tsv"
    message: "The ladder of fidelities"
    script: "../scripts/fidelity.py"


def trade_outputs(folder):
    return dict(
        trade=f"{folder}/trade.csv",
        agreement=f"{folder}/trade_references.csv",
        planner=f"{folder}/planner.csv",
        limits=f"{folder}/tables/limits.csv",
        limits_md=f"{folder}/tables/limits.md",
        summary=f"{folder}/tables/trade.md",
        figures=[f"{folder}/figures/trade_{name}.png" for name in TRADE_FIGURES],
        vectors=[f"{folder}/figures/trade_{name}.svg" for name in TRADE_FIGURES],
    )


rule trade:
    """Work-precision data, limits over steps, the planner on scenes kept apart. Costs are processor time: others may run beside."""
    input:
        needs("trade.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output: **trade_outputs(R)
    params:
        form=CONFIG.studies.trade.full.model_dump(),
    log: f"{R}/logs/trade.log"
    benchmark: f"{R}/benchmarks/trade.tsv"
    message: "Accuracy against cost"
    script: "../scripts/trade.py"


use rule trade as trade_short with:
    output: **trade_outputs(f"{R}/short")
    params: form=CONFIG.studies.trade.short.model_dump()
    log: f"{R}/logs/trade_short.log"
    benchmark: f"{R}/benchmarks/trade_short.tsv"
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
    log: f"{R}/logs/scaling.log"
    benchmark: f"{R}/benchmarks/scaling.tsv"
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
    benchmark: f"{R}/benchmarks/scaling_short.tsv"
    message: "A sweep on one process and on two, the short form"


rule traction:
    """Which flank carries drive, over creep slope and radius of the ring."""
    input:
        needs("traction.py"),
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        csv=f"{R}/traction.csv",
        figure=figure("traction"),
    params: form=(CONFIG.studies.traction.full if CONFIG.traction_in_full else CONFIG.studies.traction.short).model_dump()
    log: f"{R}/logs/traction.log"
    benchmark: f"{R}/benchmarks/traction.tsv"
    message: "Traction of the ring"
    script: "../scripts/traction.py"


rule deviations:
    """What each departure from the paper changes (docs/deviations.md); asked for by name, some minutes."""
    input:
        needs("deviations.py"),
        rig=CONFIG.rig,
        study="config/departures.yaml",
        kernels=KERNELS,
    output: f"{R}/deviations.csv"
    log: f"{R}/logs/deviations.log"
    benchmark: f"{R}/benchmarks/deviations.tsv"
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
        step=CONFIG.ring_study.step_s,
    log: f"{R}/logs/whole_loop.log"
    benchmark: f"{R}/benchmarks/whole_loop.tsv"
    message: "Short answers beside long ones"
    script: "../scripts/whole_loop.py"


use rule whole_loop as whole_loop_short with:
    output: f"{R}/short/whole_loop.csv"
    params:
        form=CONFIG.studies.whole_loop.short.model_dump(),
        step=CONFIG.ring_study.step_s,
    log: f"{R}/logs/whole_loop_short.log"
    benchmark: f"{R}/benchmarks/whole_loop_short.tsv"
