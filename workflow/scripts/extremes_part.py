from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.study.extremes.run import run_part
from trackdyn.study.settings import ExtremesForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), ExtremesForm(**snakemake.params.form)
    table = run_part(rig, form, snakemake.wildcards.part, lambda text: print(text, flush=True))
    write_csv(snakemake.output[0], table)
