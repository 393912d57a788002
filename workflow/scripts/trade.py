from trackdyn.sweeps.job import logged

import pandas as pd

from replication.paper.contents import caption
from replication.report.figures.trade import first_figure, trade_figure
from replication.report.tables import headed, trade_summary, write_captioned_table
from replication.study.accuracy.limit import presets_beside_limits
from trackdyn.files import write_csv, write_text
from trackdyn.plots.style import save

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    rows, agreement, limits = map(pd.read_csv, (given.trade, given.agreement, given.limits))
    promises = pd.concat(map(pd.read_csv, given.promises), ignore_index=True)
    write_csv(out.planner, promises)
    write_text(out.summary, trade_summary(rows, agreement, promises))
    comparison = presets_beside_limits(rows, limits)
    write_captioned_table(comparison, out.limits, caption("limits"), digits=5, shown=headed(comparison, "limits"))
    peers = pd.read_csv(given.peers[0]) if given.peers else None
    save(trade_figure(rows, peers), out.trade[0])
    save(first_figure(rows, peers), out.trade_first[0])
