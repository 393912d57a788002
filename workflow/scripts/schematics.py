from pathlib import Path
from pkgutil import resolve_name

from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import PAPER
from trackdyn.report.style import save

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    folder = Path(snakemake.output[0]).parent
    for item in PAPER:
        if item.rule == "schematics":
            save(resolve_name(item.draw)(rig), folder / f"{item.key}.png")
            print(f"{item.label}. {item.title}")
