from trackdyn.sweeps.job import logged

from laboratory.studies.departures import compare_departures
from trackdyn.files import write_csv

with logged(snakemake):
    table = compare_departures(snakemake.input.rig, snakemake.input.study)
    write_csv(snakemake.output[0], table)
