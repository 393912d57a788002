from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from replication.study.extremes.run import run_part
from replication.study.settings import ExtremesForm

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), ExtremesForm(**snakemake.params.form)
    table = run_part(rig, form, snakemake.wildcards.part, lambda text: print(text, flush=True))
    write_csv(snakemake.output[0], table)
