import pandas as pd
from _script import logged

from trackdyn import load_recording
from trackdyn.measure.meshing import mean_events, smoothed_maxima

with logged(snakemake):
    tables = []
    for run, path in zip(("meshing/no_ring", "meshing/ring"), snakemake.input.recordings, strict=True):
        recording = load_recording(path)
        tables += [mean_events(recording).assign(run=run), smoothed_maxima(recording).assign(run=run)]
    pd.concat(tables).to_csv(snakemake.output[0], index=False)
