import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn import load_recording
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.measure.metrics import run_metrics
from trackdyn.sweeps.sweep import rows_of

with logged(snakemake):
    given, rows = snakemake.input, []
    for run, path, cost in zip(snakemake.params.runs, given.recordings, given.costs, strict=True):
        wall = json.loads(Path(cost).read_text())["wall_s"]
        rows.append(run_metrics(run, replace(load_recording(path), wall=wall)))
        print(rows[-1])
    table = pd.DataFrame(rows)
    swept = rows_of(given.ring, given.ring_costs, snakemake.params.rig).rename(columns={"name": "run"})
    table = pd.concat([table, swept[list(table.columns)]], ignore_index=True)
    write_csv(snakemake.output.csv, table, float_format="%.9g")  # errors reach the seventh digit
    write_text(snakemake.output.schema, schema_text(table.columns))
