from importlib import import_module
from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.report.style import save

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    folder = Path(snakemake.output[0]).parent
    for module in snakemake.params.modules:
        for number, draw in import_module(f"trackdyn.report.figures.{module}").FIGURES.items():
            save(draw(rig), folder / f"fig{number:02d}.png")
            print(draw.__doc__.splitlines()[0])
