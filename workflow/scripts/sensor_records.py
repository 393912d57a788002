from trackdyn.sweeps.job import logged

from pathlib import Path

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import write_captioned_table
from trackdyn.measure.compare import at_rate
from trackdyn.measure.sensor import LEAST_LOOPS
from trackdyn.sensor.sensor_csv import read_sensor_csv, write_sensor_csv
from trackdyn.sensor.sensor_mapping import load_mapping

with logged(snakemake):
    params, mapping, rows = snakemake.params, load_mapping(*snakemake.input.mapping), []
    what = "synthetic, not measured" if params.synthetic else "as compared"
    for rpm, turn, path, out in zip(
        params.speeds, params.turns, snakemake.input.sensors, snakemake.output.records, strict=True
    ):
        record = at_rate(read_sensor_csv(path, mapping, params.range_g, params.gravity), params.rate)
        record.require_turns(turn, LEAST_LOOPS)
        rows.append({"speed_rpm": rpm, "file": path, **record.done})
        Path(out).parent.mkdir(parents=True, exist_ok=True)
        comments = [f"{path}: {what}", *(f"{name}: {text}" for name, text in record.done.items())]
        write_sensor_csv(out, record.t_s, record.ax_g, record.ay_g, record.az_g, comments)
    write_captioned_table(pd.DataFrame(rows), snakemake.output.csv, caption("sensor_records"))
