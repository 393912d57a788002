"""Figure 15: gap of the closed loop."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from trackdyn.plots.style import COLOURS, DASHES, PRINTED, new_figure, power_of_ten, save, styled, upper_edge
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.paper import published

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
    limit = published.LOOP_GAP
    ax.axhline(limit, **PRINTED, linewidth=1.4, zorder=4, label=f"printed in the paper: {power_of_ten(limit, 4)} m")
    longest = max(len(recording.gap) / recording.rate for recording in recordings.values())
    ax.set(xlabel="time since the start of the record (s)", ylabel="closure error (m)", yscale="log", xlim=(0, longest))
    ax.set_title("Closure error of the cut joint after (lines) and before (dots) the projection")
    figure.legend(loc="outside lower center", ncols=1)
    return figure


@run_job
def main(job) -> None:
    """Rule `closure`."""
    speeds = map(round, job.params.speeds)
    recordings = dict(zip(speeds, map(load_recording, job.input.recordings), strict=True))
    save(closure_figure(recordings), job.output[0])
