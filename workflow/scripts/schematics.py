from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.report.figures import (
    chain_piece,
    contact_cases,
    engagement,
    flow,
    groove,
    locations,
    system,
    topology,
)
from trackdyn.report.style import save

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    folder = Path(snakemake.output[0]).parent
    for module in (system, chain_piece, topology, locations, groove, engagement, contact_cases, flow):
        for number, draw in module.FIGURES.items():
            save(draw(rig), folder / f"fig{number:02d}.png")
            print(draw.__doc__.splitlines()[0])
