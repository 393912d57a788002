import pandas as pd
from _script import logged

from trackdyn.measure.sensor_csv import read_sensor_csv
from trackdyn.report.tables import lines_table, table3, write_table

with logged(snakemake):
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    metrics = pd.read_csv(snakemake.input.metrics).set_index("run").loc[snakemake.params.runs].reset_index()
    sensors = {
        rpm: read_sensor_csv(path) for rpm, path in zip(snakemake.params.speeds, snakemake.input.sensors, strict=True)
    }
    write_table(
        table3(metrics, sensors, label=label),
        snakemake.output.csv,
        f"Table 3. RMS and SD of the link's y acceleration, simulation beside the {label}. The printed differences are "
        "against the paper's own measurement, which is not public; the cells of its table are lost.",
    )
    write_table(
        lines_table(metrics, sensors, label=label),
        snakemake.output.lines_csv,
        f"Main lines of the spectra (Figure 18): printed, simulated and of the {label}.",
    )
