import pandas as pd
from _script import logged

from trackdyn.measure.sensor_csv import read_sensor_csv
from trackdyn.report.tables import LINES_CAPTION, TABLE3_CAPTION, lines_table, table3, write_table

with logged(snakemake):
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    metrics = pd.read_csv(snakemake.input.metrics).set_index("run").loc[snakemake.params.runs].reset_index()
    paths = zip(snakemake.params.speeds, snakemake.input.sensors, strict=True)
    sensors = {rpm: read_sensor_csv(path, **snakemake.params.sensor) for rpm, path in paths}
    write_table(table3(metrics, sensors, label=label), snakemake.output.csv, TABLE3_CAPTION)
    write_table(lines_table(metrics, sensors, label=label), snakemake.output.lines, LINES_CAPTION)
