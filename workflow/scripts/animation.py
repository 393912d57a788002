from _script import logged

from trackdyn import load_recording
from replication.report.figures.animation import write_animation

with logged(snakemake):
    print(write_animation(load_recording(snakemake.input.ring), snakemake.output[0]), "pictures")
