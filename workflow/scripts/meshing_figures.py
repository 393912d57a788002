from trackdyn.sweeps.job import logged

from replication.report.figures.meshing import passage_figure
from replication.report.figures.screenshots import screenshot_figure
from trackdyn import load_recording
from trackdyn.plots.style import save

with logged(snakemake):
    out = snakemake.output
    for path, passage, screenshots in (
        (snakemake.input.no_ring, out.fig19, out.fig20),
        (snakemake.input.ring, out.fig21, out.fig22),
    ):
        recording = load_recording(path)
        save(passage_figure(recording), passage[0])
        save(screenshot_figure(recording.scene.rig, recording), screenshots[0])
