from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import caption
from trackdyn.report.figures.trade import answer_figure, planner_figure, work_precision
from trackdyn.report.style import save
from trackdyn.report.tables import headed, trade_summary, write_table
from trackdyn.study.accuracy.limit import presets_beside_limits
from trackdyn.study.accuracy.planner import verify
from trackdyn.study.accuracy.trade import state_trade, statistic_trade
from trackdyn.study.settings import TradeForm


def _joined(*tables):
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


with logged(snakemake):
    rig, form, out = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form), snakemake.output
    states, second = state_trade(rig, form.state)
    statistics, other, limits = statistic_trade(rig, form.statistics)
    rows, agreement = _joined(states, statistics), _joined(second, other)
    promises = verify(rig, rows, form.kept_apart, form.statistics.loop_turns, form.limit_steps_s)
    for table, path in ((rows, out.trade), (agreement, out.agreement), (promises, out.planner)):
        Path(path).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
    Path(out.summary).write_text(trade_summary(rows, agreement, promises), encoding="utf-8")
    beside = presets_beside_limits(rows, limits)
    write_table(beside, out.limits, caption("limits"), digits=5, shown=headed(beside, "limits"))
    figures = [work_precision(rows, name) for name in ("state_m", "rms", "left_share")]
    for figure, path in zip([*figures, answer_figure(rows, "left_peak"), planner_figure(promises)], out.figures, strict=True):
        save(figure, path)
