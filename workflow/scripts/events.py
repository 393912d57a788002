from trackdyn.sweeps.job import logged

import pandas as pd

from trackdyn import load_recording
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.measure.contacts import mean_events, smoothed_maxima, spells

with logged(snakemake):
    tables, contacts = [], []
    for run, path in zip(("meshing/no_ring", "meshing/ring"), snakemake.input.recordings, strict=True):
        recording = load_recording(path)
        contacts.append(spells(recording).assign(run=run))
        tables += [mean_events(recording).assign(run=run), smoothed_maxima(recording).assign(run=run)]
    found = pd.concat(tables)
    write_csv(snakemake.output.events, found)
    write_text(snakemake.output.schema, schema_text(found.columns, "events"))
    write_csv(snakemake.output.spells, pd.concat(contacts))
