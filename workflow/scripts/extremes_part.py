from trackdyn.sweeps.job import logged

from replication.study.extremes.run import run_part
from replication.study.settings import ExtremesForm
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), ExtremesForm(**snakemake.params.form)
    table = run_part(rig, form, snakemake.wildcards.part, lambda text: print(text, flush=True))
    write_csv(snakemake.output[0], table)
