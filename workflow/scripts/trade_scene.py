from trackdyn.sweeps.job import logged

from replication.study.accuracy.trade import statistic_trade
from replication.study.settings import TradeForm, measured_scenes
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    tables = statistic_trade(rig, measured_scenes(form)[snakemake.wildcards.part])
    for table, path in zip(tables, snakemake.output, strict=True):
        write_csv(path, table)
