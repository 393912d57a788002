from trackdyn.sweeps.job import logged

from replication.report.figures.closure import closure_figure
from trackdyn import load_recording
from trackdyn.plots.style import save

with logged(snakemake):
    recordings = {
        round(rpm): load_recording(path)
        for rpm, path in zip(snakemake.params.speeds, snakemake.input.recordings, strict=True)
    }
    save(closure_figure(recordings), snakemake.output[0])
