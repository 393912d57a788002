from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from replication.study.accuracy.planner import load_trade, verify
from replication.study.accuracy.statistics import promised_scenes
from replication.study.settings import TradeForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    apart = promised_scenes(form)[snakemake.wildcards.part]
    trade, turns = load_trade(snakemake.input.trade), form.statistics.loop_turns
    table = verify(rig, trade, [apart], turns, form.limit_steps_s, form.promised)
    write_csv(snakemake.output[0], table)
