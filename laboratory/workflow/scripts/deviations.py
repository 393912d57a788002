from _script import logged

from trackdyn.files import write_csv
from laboratory.studies.departures import compare_departures

with logged(snakemake):
    table = compare_departures(snakemake.input.rig, snakemake.input.study)
    write_csv(snakemake.output[0], table)
