from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.study.extremes.run import run_part
from trackdyn.study.settings import ExtremesForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), ExtremesForm(**snakemake.params.form)
    table = run_part(rig, form, snakemake.wildcards.part, lambda text: print(text, flush=True))
    Path(snakemake.output[0]).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
