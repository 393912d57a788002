from _script import logged

from trackdyn import Rig, load_recording
from trackdyn.report.figures.meshing import passage_figure
from trackdyn.report.figures.screenshots import screenshot_figure
from trackdyn.report.style import save

with logged(snakemake):
    for number, path in ((19, snakemake.input.no_ring), (21, snakemake.input.ring)):
        recording = load_recording(path)
        rig = Rig.model_validate(recording.meta["rig"])
        first = snakemake.output[2 * (number - 19)]
        save(passage_figure(recording), first)
        save(screenshot_figure(rig, recording), snakemake.output[2 * (number - 19) + 2])
