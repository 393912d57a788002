import pandas as pd
from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from replication.study.accuracy.limit import LIMITS
from replication.study.accuracy.statistics import measured_scenes
from replication.study.accuracy.trade import state_trade, statistic_trade
from replication.study.settings import StateErrors, TradeForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    asked = measured_scenes(form)[snakemake.wildcards.part]
    if isinstance(asked, StateErrors):  # measured against references: nothing is extrapolated
        tables = (*state_trade(rig, asked), pd.DataFrame(columns=LIMITS))
    else:
        tables = statistic_trade(rig, asked)
    for table, path in zip(tables, snakemake.output, strict=True):
        write_csv(path, table)
