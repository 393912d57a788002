import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn import load_recording
from trackdyn.measure.dictionary import table_schema
from trackdyn.measure.metrics import run_metrics
from trackdyn.replacing import write_csv, write_text

with logged(snakemake):
    rows = []
    for run, path, cost in zip(snakemake.params.runs, snakemake.input.recordings, snakemake.input.costs, strict=True):
        wall = json.loads(Path(cost).read_text())["wall_s"]
        rows.append(run_metrics(run, replace(load_recording(path), wall=wall)))
        print(rows[-1])
    table = pd.DataFrame(rows)
    write_csv(snakemake.output.csv, table, float_format="%.9g")  # errors reach the seventh digit
    schema = json.dumps(table_schema(table.columns), indent=1, ensure_ascii=False)
    write_text(snakemake.output.schema, schema + "\n")
