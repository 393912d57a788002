from trackdyn.sweeps.job import logged

from pathlib import Path

from replication.paper.contents import PAPER
from replication.report.figures import chain_piece, contact_cases, engagement, flow, groove, locations, system, topology
from trackdyn import load_rig
from trackdyn.plots.style import save

MODULES = (system, chain_piece, topology, locations, groove, engagement, contact_cases, flow)

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    modules = {module.__name__: module for module in MODULES}
    for item in PAPER:
        if item.rule == snakemake.rule:
            module, name = item.draw.split(":")
            save(getattr(modules[module], name)(rig), Path(snakemake.output[0]).with_name(f"{item.key}.png"))
            print(f"{item.label}. {item.title}")
