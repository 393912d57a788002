from trackdyn.sweeps.job import logged

import pandas as pd

from trackdyn import load_recording
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.measure.metrics import run_metrics

with logged(snakemake):
    runs = zip(snakemake.params.runs, snakemake.input.recordings, strict=True)
    table = pd.DataFrame([run_metrics(run, load_recording(path)) for run, path in runs])
    write_csv(snakemake.output.csv, table, float_format="%.9g")  # errors reach the seventh digit
    write_text(snakemake.output.schema, schema_text(table.columns))
