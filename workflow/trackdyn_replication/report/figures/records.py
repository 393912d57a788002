"""Figures 17 and 18: time histories and spectra of every speed, with those of the sensor."""

from trackdyn.sweeps.snakemake_job import run_job

from itertools import zip_longest
from math import inf, pi

from trackdyn.fieldtest.figures import history_figure, spectrum_figure
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import main_line
from trackdyn.plots.style import save
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.paper.published import SENSORS, lettered, peaks


def rounded_peak(recording: Recording) -> tuple[str, float, float, str]:
    """Return the dominant peak of a run: label with the sprocket's speed, frequency (Hz), amplitude (g), marker."""
    sprocket_rpm = abs(recording.scene.sprocket_rate) * 30 / pi
    line = main_line(sense(recording).ay, recording.rate, recording.periods.loop_hz)
    return f"at {sprocket_rpm:.4g} rev/min", *line, "^"


@run_job
def main(job) -> None:
    """Rule `sensor_figures`."""
    inputs, out = job.input, job.output
    label, sensors = SENSORS[job.params.synthetic], inputs.get("sensors", ())
    rounded = dict(zip(job.params.speeds, inputs.rounded, strict=True))
    for path, sensor, history, spectrum in zip_longest(inputs.recordings, sensors, out.histories, out.spectra):
        recording, record = load_recording(path), read_sensor(sensor, range_g=inf) if sensor else None
        rpm = recording.scene.motor_rpm
        title = lettered(f"{rpm:g} rpm", rpm)
        save(history_figure(recording, record, title, label), history)
        others = peaks(rpm) + [rounded_peak(load_recording(path)) for speed, path in rounded.items() if speed == rpm]
        save(spectrum_figure(recording, record, title, label, others), spectrum)
