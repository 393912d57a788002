from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.study.accuracy.scenes import measured_scenes
from trackdyn.study.accuracy.trade import state_trade, statistic_trade
from trackdyn.study.settings import StateErrors, TradeForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), TradeForm(**snakemake.params.form)
    asked = measured_scenes(form)[snakemake.wildcards.part]
    study = state_trade if isinstance(asked, StateErrors) else statistic_trade
    for table, path in zip(study(rig, asked), snakemake.output, strict=True):
        Path(path).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
