from trackdyn.sweeps.job import logged

from math import inf

from replication.paper.printed import lettered, peaks
from trackdyn import load_recording
from trackdyn.plots.histories import history_figure
from trackdyn.plots.spectra import spectrum_figure
from trackdyn.plots.style import save
from trackdyn.sensor.sensor_csv import read_sensor_csv

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    label = "synthetic sensor" if snakemake.params.synthetic else "sensor"
    files = zip(given.recordings, given.sensors, out.histories, out.spectra, strict=True)
    for path, sensor, history, spectrum in files:
        recording, record = load_recording(path), read_sensor_csv(sensor, range_g=inf)
        rpm = recording.scene.motor_rpm
        title = lettered(f"{rpm:g} rpm", rpm)
        save(history_figure(recording, record, title, label), history)
        save(spectrum_figure(recording, record, title, label, peaks(rpm)), spectrum)
