import pandas as pd

from trackdyn.sweeps.job import logged
from replication.paper.contents import caption
from replication.report.figures.trade import answer_figure, planner_figure, work_precision
from replication.report.tables import headed, trade_summary, write_captioned_table
from replication.study.accuracy.limit import presets_beside_limits
from replication.study.accuracy.planner import load_trade
from trackdyn.files import write_csv, write_text
from trackdyn.plots.style import save

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    rows, agreement, limits = load_trade(given.trade), pd.read_csv(given.agreement), pd.read_csv(given.limits)
    promises = pd.concat(map(pd.read_csv, given.promises), ignore_index=True)
    write_csv(out.planner, promises)
    write_text(out.summary, trade_summary(rows, agreement, promises))
    beside = presets_beside_limits(rows, limits)
    write_captioned_table(beside, out.limits, caption("limits"), digits=5, shown=headed(beside, "limits"))
    figures = [work_precision(rows, name) for name in ("state_m", "rms", "left_share")]
    for figure, path in zip(
        [*figures, answer_figure(rows, "left_peak"), planner_figure(promises)], out.figures, strict=True
    ):
        save(figure, path)
