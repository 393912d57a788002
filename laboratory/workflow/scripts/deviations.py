from trackdyn.sweeps.job import logged

from replication.study.departures import compare_departures
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    write_csv(snakemake.output[0], compare_departures(load_rig(snakemake.input.rig)))
