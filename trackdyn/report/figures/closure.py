"""Figure 15: how far the closed loop gapes."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from trackdyn.recording import Recording
from trackdyn.report import printed
from trackdyn.report.style import COLOURS, DASHES, PRINTED, new_figure, styled

# A gap of exactly nothing has no place on a logarithmic axis; below the spacing of doubles near 1 m.
LEAST_GAP = 1e-17
STRETCHES = 90  # of a record, for its upper edge


@styled
def closure_figure(recordings: Mapping[int, Recording]) -> Figure:
    """Largest distance of the two ends of the loop over time, for every speed.

    Each curve shows the largest gap of the sample intervals in a ninetieth of the record, and below it
    in a pale band down to the least of them.

    Parameters
    ----------
    recordings : mapping
        Motor speed (rev/min) to its recording.
    """
    figure = new_figure(3.6)
    ax = figure.subplots()
    for i, (rpm, recording) in enumerate(sorted(recordings.items())):
        time, least, largest = _edges(recording)
        colour = COLOURS[i % len(COLOURS)]
        peak = float(recording.gap.max())
        ax.fill_between(time, least, largest, color=colour, alpha=0.12, linewidth=0)
        ax.plot(
            time, largest, color=colour, linestyle=DASHES[i % len(DASHES)], marker="",
            label=f"{rpm:g} rpm, largest {peak:.4g} m",
        )  # fmt: skip
    ax.axhline(printed.LOOP_GAP.value, **PRINTED, linewidth=1.2, label=f"printed: {printed.LOOP_GAP.value:.5g} m")
    ax.set_yscale("log")
    low, high = ax.get_ylim()
    ax.set_ylim(low, high * 10 ** (0.35 * np.log10(high / low)))  # room for the legend
    ax.set_xlabel("time since the start of the record (s)")
    ax.set_ylabel("distance of the two ends of the loop (m)")
    ax.set_title("Largest gap of the cut joint in a sample interval")
    ax.legend(loc="upper right", ncols=2)
    return figure


def _edges(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle times of the stretches, and least and largest gap in each."""
    gap = np.maximum(recording.gap, LEAST_GAP)
    edges = np.unique(np.linspace(0, len(gap), STRETCHES + 1).astype(int))
    first = edges[:-1]
    time = 0.5 * (first + edges[1:]) / recording.rate
    return time, np.minimum.reduceat(gap, first), np.maximum.reduceat(gap, first)
