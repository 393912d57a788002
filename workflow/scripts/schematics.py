from _script import logged

from trackdyn import load_rig
from trackdyn.report.figures.chain_piece import piece_figure
from trackdyn.report.figures.contact_cases import concave_figure, convex_figure, link_figure
from trackdyn.report.figures.engagement import engagement_figure, sector_figure
from trackdyn.report.figures.flow import flow_figure
from trackdyn.report.figures.groove import detection_figure, section_figure
from trackdyn.report.figures.locations import locations_figure
from trackdyn.report.figures.system import setup_figure, system_figure
from trackdyn.report.figures.topology import topology_figure
from trackdyn.report.style import save

# Figures 1 to 12 and 16
FIGURES = (
    system_figure, piece_figure, topology_figure, locations_figure, section_figure, engagement_figure, sector_figure,
    detection_figure, convex_figure, concave_figure, flow_figure, link_figure, setup_figure,
)  # fmt: skip

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    for draw, path in zip(FIGURES, snakemake.output[::2], strict=True):
        save(draw(rig), path)
        print(draw.__doc__.splitlines()[0])
