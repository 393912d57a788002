from trackdyn.sweeps.job import logged

from replication.report.figures.animation import write_animation
from trackdyn import load_recording

with logged(snakemake):
    print(write_animation(load_recording(snakemake.input.ring), snakemake.output[0]), "pictures")
