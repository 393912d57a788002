from trackdyn.sweeps.job import logged
from replication.study.accuracy.planner import load_trade, verify_promises
from replication.study.settings import TradeForm, promised_scenes
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    apart = promised_scenes(form)[snakemake.wildcards.part]
    trade, turns = load_trade(snakemake.input.trade), form.statistics.loop_turns
    table = verify_promises(rig, trade, [apart], turns, form.limit_steps_s, form.promised)
    write_csv(snakemake.output[0], table)
