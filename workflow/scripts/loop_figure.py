from trackdyn.sweeps.job import logged

from replication.report.figures.loop import loop_figure
from trackdyn import load_recording
from trackdyn.plots.style import save

with logged(snakemake):
    recording = load_recording(snakemake.input.recording)
    save(loop_figure(recording.scene.rig, recording), snakemake.output[0])
