"""Figures 1 to 12 and 16: geometry and structure of the simulator, drawn from a rig."""

from trackdyn.sweeps.snakemake_job import run_job

from functools import partial
from pathlib import Path

from trackdyn.plots.style import save
from trackdyn.rig.rig import load_rig
from trackdyn_replication.report.figures.chain import piece_figure, topology_figure
from trackdyn_replication.report.figures.contact import arc_figure, flow_figure, link_figure
from trackdyn_replication.report.figures.groove import (
    detection_figure,
    engagement_figure,
    section_figure,
    sector_figure,
)
from trackdyn_replication.report.figures.system import locations_figure, setup_figure, system_figure

FIGURES = {
    1: system_figure, 2: piece_figure, 3: topology_figure, 4: locations_figure, 5: section_figure,
    6: engagement_figure, 7: sector_figure, 8: detection_figure, 9: partial(arc_figure, area=1),
    10: partial(arc_figure, area=2), 11: flow_figure, 12: link_figure, 16: setup_figure,
}  # fmt: skip


@run_job
def main(job) -> None:
    """Rule `schematics`."""
    rig, folder = load_rig(job.input.rig), Path(job.output[0]).parent
    for number, draw in FIGURES.items():
        save(draw(rig), folder / f"fig{number:02d}.png")
