from math import inf

from _script import logged

from trackdyn import load_recording
from trackdyn.report.figures.histories import history_figure
from trackdyn.report.figures.spectra import spectrum_figure
from trackdyn.report.style import save
from trackdyn.sensor.sensor_csv import read_sensor_csv

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    files = zip(given.recordings, given.sensors, out.histories[::2], out.spectra[::2], strict=True)
    for path, sensor, history, spectrum in files:
        recording, record = load_recording(path), read_sensor_csv(sensor, range_g=inf)
        title = f"{recording.meta['scene']['motor_rpm']:g} rpm"
        save(history_figure(recording, record, title=title, sensor_label=label), history)
        save(spectrum_figure(recording, record, title=title, sensor_label=label), spectrum)
