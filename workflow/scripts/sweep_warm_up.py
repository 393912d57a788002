from trackdyn.sweeps.job import logged

from trackdyn.files import write_text
from trackdyn.jit import cache_folder
from trackdyn.sweeps.sweep import one_of_each_kind, sweep

with logged(snakemake):
    rows = one_of_each_kind(snakemake.input.design)
    print(sweep(rows, rig=snakemake.input.rig, jobs=1, store=snakemake.params.store)[["state", "reason"]])
    write_text(snakemake.output[0], f"{cache_folder().name}\n")
