from trackdyn.sweeps.job import logged

from pathlib import Path

import pandas as pd

from laboratory.report.figures.wear import life_figure
from laboratory.report.wear import LIFE, wear_text
from trackdyn.files import write_csv
from trackdyn.plots.style import save

with logged(snakemake):
    tables = []
    for path in snakemake.input.lives:
        rig, rpm, tension, radius = Path(path).stem.rsplit("_", 3)
        life = dict(zip(LIFE, (rig, float(rpm), tension, float(radius)), strict=True))
        tables.append(pd.read_parquet(path).drop(columns="depths").assign(**life))
    lives = pd.concat(tables, ignore_index=True)
    write_csv(snakemake.output.csv, lives, float_format="%.7g")
    # friction of the others wears no real ring
    save(life_figure(lives, "possible"), snakemake.output.figures[0])
    print(wear_text(lives))
