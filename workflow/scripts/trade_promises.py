from trackdyn.sweeps.job import logged

from replication.study.accuracy.promises import judge_promises
from replication.study.settings import TradeForm, promised_scenes
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    scene = promised_scenes(form)[snakemake.wildcards.part]
    table = judge_promises(rig, *scene, form.statistics.loop_turns, form.limit_steps_s, form.promised)
    write_csv(snakemake.output[0], table)
