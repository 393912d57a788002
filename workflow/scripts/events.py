import pandas as pd
from _script import logged

from trackdyn import load_recording
from trackdyn.measure.meshing import mean_events

with logged(snakemake):
    tables = [
        mean_events(load_recording(path)).assign(run=run)
        for run, path in zip(("meshing/no_ring", "meshing/ring"), snakemake.input.recordings, strict=True)
    ]
    pd.concat(tables).to_csv(snakemake.output[0], index=False)
