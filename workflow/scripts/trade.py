from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn.report.figures.trade import planner_figure, scaling_figure, work_precision
from trackdyn.report.style import save
from trackdyn.report.tables import trade_summary
from trackdyn.study.accuracy.planner import load_trade

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    rows, agreement, times = load_trade(given.trade), pd.read_csv(given.agreement), pd.read_csv(given.scaling)
    promises = pd.concat(map(pd.read_csv, given.promises), ignore_index=True)
    Path(out.planner).write_text(promises.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
    Path(out.summary).write_text(trade_summary(rows, agreement, promises, times), encoding="utf-8")
    figures = [work_precision(rows, name) for name in ("state_m", "rms", "left_share")]
    for figure, path in zip([*figures, scaling_figure(times), planner_figure(promises)], out.figures, strict=True):
        save(figure, path)
