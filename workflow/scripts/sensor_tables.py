from math import inf

import pandas as pd
from _script import logged

from trackdyn.measure.sensor_csv import read_sensor_csv
from trackdyn.paper.contents import caption
from trackdyn.report.tables import lines_table, table3, write_table

with logged(snakemake):
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    metrics = pd.read_csv(snakemake.input.metrics).set_index("run").loc[snakemake.params.runs].reset_index()
    paths = zip(snakemake.params.speeds, snakemake.input.sensors, strict=True)
    sensors = {rpm: read_sensor_csv(path, range_g=inf) for rpm, path in paths}
    for key, table, path in (("table3", table3, snakemake.output.csv), ("lines", lines_table, snakemake.output.lines)):
        write_table(table(metrics, sensors, label=label), path, caption(key, snakemake.params.synthetic))
