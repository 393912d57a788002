from math import inf

from _script import logged

from trackdyn import load_recording
from trackdyn.measure.sensor_csv import read_sensor_csv
from trackdyn.report.figures.histories import history_figure
from trackdyn.report.figures.spectra import spectrum_figure
from trackdyn.report.style import save

with logged(snakemake):
    recording = load_recording(snakemake.input.recording)
    record = read_sensor_csv(snakemake.input.sensor, range_g=inf)
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    title = f"{recording.meta['scene']['motor_rpm']:g} rpm"
    save(history_figure(recording, record, title=title, sensor_label=label), snakemake.output.history[0])
    save(spectrum_figure(recording, record, title=title, sensor_label=label), snakemake.output.spectrum[0])
