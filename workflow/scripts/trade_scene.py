import pandas as pd

from trackdyn.sweeps.job import logged
from replication.study.accuracy.limit import LIMITS
from replication.study.accuracy.trade import state_trade, statistic_trade
from replication.study.settings import StateErrors, TradeForm, measured_scenes
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    asked = measured_scenes(form)[snakemake.wildcards.part]
    if isinstance(asked, StateErrors):  # measured against references: nothing is extrapolated
        tables = (*state_trade(rig, asked), pd.DataFrame(columns=LIMITS))
    else:
        tables = statistic_trade(rig, asked)
    for table, path in zip(tables, snakemake.output, strict=True):
        write_csv(path, table)
