from _script import logged

from trackdyn import load_recording
from trackdyn.report.figures.animation import still_loop, still_sprocket, write_animation
from trackdyn.report.style import save

with logged(snakemake):
    ring, no_ring = load_recording(snakemake.input.ring), load_recording(snakemake.input.no_ring)
    save(still_loop(ring), snakemake.output.loop[0])
    save(still_sprocket(ring), snakemake.output.sprocket[0])
    save(still_sprocket(no_ring), snakemake.output.no_ring[0])
    print(write_animation(ring, snakemake.output.gif), "pictures")
