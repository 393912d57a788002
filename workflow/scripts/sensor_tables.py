from trackdyn.sweeps.job import logged

from math import inf

import pandas as pd

from replication.paper.contents import caption
from replication.report.tables import headed, lines_table, table3, write_captioned_table
from trackdyn.sensor.sensor_csv import read_sensor_csv

with logged(snakemake):
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    metrics = pd.read_csv(snakemake.input.metrics).set_index("run").loc[snakemake.params.runs].reset_index()
    paths = zip(snakemake.params.speeds, snakemake.input.sensors, strict=True)
    sensors = {rpm: read_sensor_csv(path, range_g=inf) for rpm, path in paths}
    for key, make, path in (("table3", table3, snakemake.output.csv), ("lines", lines_table, snakemake.output.lines)):
        table, text = make(metrics, sensors, label=label), caption(key, snakemake.params.synthetic)
        write_captioned_table(table, path, text, digits=4 if key == "lines" else 3, shown=headed(table, key))
