from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn import load_rig
from trackdyn.report.figures.trade import planner_figure, scaling_figure, work_precision
from trackdyn.report.style import save
from trackdyn.report.tables import trade_summary
from trackdyn.study.accuracy import planner, trade

SHORT_COARSE = {"linearly_implicit": (5e-4,)}
SHORT_STEPS = {"semi_implicit": (5e-5, 1e-4, 5e-4), "linearly_implicit": (2.5e-4, 5e-4), "rk4": (1e-4,)}


def _joined(*tables):
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


def measure(rig, short):
    if not short:
        state, state_agreement = trade.state_trade(rig)
        rows, agreement = trade.statistic_trade(rig, planner.MEASURED, turns=3)
        return _joined(state, rows), _joined(state_agreement, agreement), planner.HELD_OUT, 3
    state, state_agreement = trade.state_trade(rig, SHORT_STEPS, (1e-4, 1e-6), ("ring 115 rpm", "one impact"))
    rows, agreement = trade.statistic_trade(rig, planner.MEASURED_SHORT, 2, SHORT_STEPS, SHORT_COARSE, check=False)
    return _joined(state, rows), _joined(state_agreement, agreement), planner.HELD_OUT_SHORT, 2


# new processes import this file: only the first one runs the study
if __name__ == "__main__":
    with logged(snakemake):
        rig, short, out = load_rig(snakemake.input.rig), snakemake.params.short, snakemake.output
        rows, agreement, held_out, turns = measure(rig, short)
        promises = planner.verify(rig, rows, held_out, turns)
        scaling = trade.scaling(rig, jobs=(1, 2, 4) if short else (1, 2, 4, 8), seconds=5.0 if short else 20.0)
        for table, path in (
            (rows, out.trade), (agreement, out.agreement), (promises, out.planner), (scaling, out.scaling),
        ):  # fmt: skip
            Path(path).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
        Path(out.summary).write_text(trade_summary(rows, agreement, promises, scaling), encoding="utf-8")
        figures = [work_precision(rows, name) for name in ("state_m", "rms", "left_share")]
        for figure, path in zip(
            [*figures, scaling_figure(scaling), planner_figure(promises)], out.figures, strict=True
        ):
            save(figure, path)
