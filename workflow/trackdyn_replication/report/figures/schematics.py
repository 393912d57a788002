"""Figures 1 to 12 and 16: geometry and structure of the simulator, drawn from a rig."""

from trackdyn.sweeps.snakemake_job import run_job

from functools import partial
from pathlib import Path

from trackdyn.plots.style import save
from trackdyn.rig.rig import load_rig
from trackdyn_replication.report.figures import contact, groove, system

FIGURES = {
    1: system.system_figure, 2: system.piece_figure, 3: system.topology_figure, 4: system.locations_figure,
    5: groove.section_figure, 6: groove.engagement_figure, 7: groove.sector_figure, 8: groove.detection_figure,
    9: partial(contact.arc_figure, area=1), 10: partial(contact.arc_figure, area=2), 11: contact.flow_figure,
    12: contact.link_figure, 16: system.setup_figure,
}  # fmt: skip


@run_job
def main(job) -> None:
    """Rule `schematics`."""
    rig, folder = load_rig(job.input.rig), Path(job.output[0]).parent
    for number, draw in FIGURES.items():
        save(draw(rig), folder / f"fig{number:02d}.png")
