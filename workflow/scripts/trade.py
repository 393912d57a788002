import pandas as pd
from _script import logged

from trackdyn import load_rig
from trackdyn.replacing import write_csv, write_text
from trackdyn.report.figures.trade import planner_figure, scaling_figure, work_precision
from trackdyn.report.style import save
from trackdyn.report.tables import trade_summary
from trackdyn.study.accuracy.planner import verify
from trackdyn.study.accuracy.trade import scaling, state_trade, statistic_trade
from trackdyn.study.settings import TradeForm


def _joined(*tables):
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


# new processes import this file: only the first one runs the study
if __name__ == "__main__":
    with logged(snakemake):
        rig, form, out = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form), snakemake.output
        rows, agreement = map(_joined, state_trade(rig, form.state), statistic_trade(rig, form.statistics))
        promises = verify(rig, rows, form.kept_apart, form.statistics.loop_turns)
        times = scaling(rig, form.scaling_runs, form.scaling_s)
        for table, path in (
            (rows, out.trade), (agreement, out.agreement), (promises, out.planner), (times, out.scaling),
        ):  # fmt: skip
            write_csv(path, table)
        write_text(out.summary, trade_summary(rows, agreement, promises, times))
        figures = [work_precision(rows, name) for name in ("state_m", "rms", "left_share")]
        for figure, path in zip([*figures, scaling_figure(times), planner_figure(promises)], out.figures, strict=True):
            save(figure, path)
