"""Figures 15, 17 and 18: gap of the closed loop, time histories and spectra of every speed, with the sensor's."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Mapping
from itertools import zip_longest
from math import inf, pi

import numpy as np
from matplotlib.figure import Figure

from trackdyn.fieldtest.figures import history_figure, spectrum_figure
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import main_line
from trackdyn.plots.style import COLOURS, DASHES, PRINTED, new_figure, power_of_ten, save, styled, upper_edge
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.paper.published import LOOP_GAP, SENSORS, SPEEDS_RPM, peaks

LEAST_GAP = 1e-17  # of nothing on a logarithmic axis; below the spacing of doubles near 1 m
STRETCHES = 180  # parts of a record; the curve shows the largest gap in each


@styled
def closure_figure(recordings: Mapping[int, Recording]) -> Figure:
    """Draw the largest gap of the loop over time, after (lines) and before (dots) the projection of a step."""
    figure = new_figure(4.0)
    ax = figure.subplots()
    for i, (rpm, recording) in enumerate(sorted(recordings.items())):
        gaps = recording.gap, recording.cut[:, 0]
        (edges, largest), (_, opened) = (upper_edge(np.maximum(gap, LEAST_GAP), STRETCHES) for gap in gaps)
        time, colour = 0.5 * (edges[:-1] + edges[1:]) / recording.rate, COLOURS[i % len(COLOURS)]
        after, before = (power_of_ten(gap.max(), 2) for gap in gaps)
        label = f"{rpm:g} rpm: largest {after} m, before {before} m"
        ax.plot(time, largest, color=colour, linestyle=DASHES[i % len(DASHES)], label=label)
        ax.plot(time, opened, color=colour, linestyle="none", marker=".", markersize=2.0)
    label = f"printed in the paper: {power_of_ten(LOOP_GAP, 4)} m"
    ax.axhline(LOOP_GAP, **PRINTED, linewidth=1.4, zorder=4, label=label)
    longest = max(len(recording.gap) / recording.rate for recording in recordings.values())
    ax.set(xlabel="time since the start of the record (s)", ylabel="closure error (m)", yscale="log", xlim=(0, longest))
    ax.set_title("Closure error of the cut joint after (lines) and before (dots) the projection")
    figure.legend(loc="outside lower center", ncols=1)
    return figure


@run_job
def main(job) -> None:
    """Rules `closure` and `sensor_figures`."""
    inputs, out = job.input, job.output
    if job.rule == "closure":
        speeds = map(round, job.params.speeds)
        save(closure_figure(dict(zip(speeds, map(load_recording, inputs.recordings), strict=True))), out[0])
        return
    label, sensors = SENSORS[job.params.synthetic], inputs.get("sensors", ())
    rounded = dict(zip(job.params.speeds, inputs.rounded, strict=True))
    for path, sensor, history, spectrum in zip_longest(inputs.recordings, sensors, out.histories, out.spectra):
        recording, record = load_recording(path), read_sensor(sensor, range_g=inf) if sensor else None
        rpm = recording.scene.motor_rpm
        letter = f"({'abcd'[SPEEDS_RPM.index(rpm)]}) " if rpm in SPEEDS_RPM else ""  # of the paper's panel
        title = f"{letter}{rpm:g} rpm"
        save(history_figure(recording, record, title, label), history)
        others = peaks(rpm)
        if rpm in rounded:
            run = load_recording(rounded[rpm])
            line = main_line(sense(run).ay, run.rate, run.periods.loop_hz)
            others.append((f"at {abs(run.scene.sprocket_rate) * 30 / pi:.4g} rev/min", *line, "^"))
        save(spectrum_figure(recording, record, title, label, others), spectrum)
