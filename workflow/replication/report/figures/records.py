"""Figures 17 and 18: time histories and spectra of every speed beside the sensor's."""

from trackdyn.sweeps.snakemake_job import run_job

from itertools import zip_longest
from math import inf

from replication.paper.printed import SENSORS, lettered, peaks
from trackdyn.plots.spectra import history_figure, spectrum_figure
from trackdyn.plots.style import save
from trackdyn.sensor.sensor_csv import read_sensor
from trackdyn.simulation.recording import load_recording


@run_job
def main(job) -> None:
    """Rule `sensor_figures`."""
    inputs, out = job.input, job.output
    label, sensors = SENSORS[job.params.synthetic], inputs.get("sensors", ())
    for path, sensor, history, spectrum in zip_longest(inputs.recordings, sensors, out.histories, out.spectra):
        recording, record = load_recording(path), read_sensor(sensor, range_g=inf) if sensor else None
        rpm = recording.scene.motor_rpm
        title = lettered(f"{rpm:g} rpm", rpm)
        save(history_figure(recording, record, title, label), history)
        save(spectrum_figure(recording, record, title, label, peaks(rpm)), spectrum)
