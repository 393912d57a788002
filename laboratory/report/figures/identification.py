"""Pictures of an identification: the posterior of the unknowns, and records beside what is predicted of them."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

from laboratory.plausible.unknowns import Unknown
from trackdyn.plots.style import (
    BLACK,
    BLUE,
    DASHES,
    PAGE,
    SENSOR,
    SIMULATION,
    SMALL,
    VERMILION,
    WIDTH,
    new_figure,
    styled,
    thin,
)

CELLS = 30
SMOOTHED, LEAST_CELLS = 1.3, 2.5  # cells: standard deviations of the smoothing, and of the draws that are smoothed
MASSES = (0.9, 0.5)  # shares of the draws within the contours


@styled
def posterior_figure(
    unknowns: Sequence[Unknown], points: np.ndarray, best: np.ndarray, verdicts: Sequence[str]
) -> Figure:
    """Every unknown over its range, and every two of them.

    ``points`` are (s, d) draws as positions between 0 and 1, ``best`` is where the posterior is highest.
    """
    count = len(unknowns)
    figure = new_figure(max(min(1.75 * count, PAGE), 2.6), max(min(1.8 * count, PAGE), WIDTH * 0.75))
    axes = np.atleast_2d(figure.subplots(count, count, squeeze=False))
    for i, j in np.ndindex(count, count):
        ax = axes[i, j]
        if j > i:
            ax.set_axis_off()
            continue
        ax.set_xlim(0, 1)
        _ticks(ax.xaxis, unknowns[j], i == count - 1)
        if i == j:
            ax.hist(points[:, i], bins=CELLS, range=(0, 1), density=True, color=BLUE, alpha=0.35)
            ax.axhline(1.0, color=BLACK, linestyle=DASHES[1], linewidth=0.8)
            ax.axvline(best[i], color=VERMILION)
            ax.set_yticks([])
            ax.set_title(f"{unknowns[i].label.replace('.', chr(10))}\n{verdicts[i]}", fontsize=SMALL)
        else:
            ax.set_ylim(0, 1)
            _ticks(ax.yaxis, unknowns[i], j == 0)
            _contours(ax, points[:, j], points[:, i])
            ax.plot(best[j], best[i], "o", color=VERMILION, markersize=3)
    return figure


def _ticks(axis, unknown: Unknown, labelled: bool) -> None:
    places = [0.1, 0.5, 0.9]
    values = [unknown.value(x) for x in places]
    words = [f"{value:.0f}" if 100 <= abs(value) < 1e5 else f"{value:.2g}" for value in values]
    axis.set_ticks(places, words if labelled else [""] * 3)


def _contours(ax, x, y) -> None:
    """Contours that hold `MASSES` of the draws; the draws themselves where they would be as wide as smoothed."""
    if min(x.std(), y.std()) * CELLS < LEAST_CELLS:
        ax.plot(x, y, ".", color=BLUE, markersize=1, alpha=0.3)
        return
    heights, _, _ = np.histogram2d(x, y, bins=CELLS, range=[[0, 1], [0, 1]])
    heights = gaussian_filter(heights, SMOOTHED, mode="constant")
    falling = np.sort(heights.ravel())[::-1]
    levels = [falling[np.searchsorted(np.cumsum(falling) / falling.sum(), mass)] for mass in MASSES]
    middle = (np.arange(CELLS) + 0.5) / CELLS
    ax.contourf(middle, middle, heights.T, [*levels, falling[0] * 1.001], colors=[BLUE, BLUE], alpha=0.35)
    ax.contour(middle, middle, heights.T, levels, colors=BLUE, linestyles=["--", "-"], linewidths=0.8)


@styled
def features_figure(table: pd.DataFrame, sensor: str) -> Figure:
    """Every feature of every record beside its 90 % interval, over the median that is predicted of it.

    With columns ``sim_q05, sim_q95`` it shows what simulations alone give, too.
    """
    records = list(dict.fromkeys(table["record"]))
    figure = new_figure(0.7 + 1.75 * len(records), PAGE)
    axes = figure.subplots(len(records), 1, squeeze=False, sharex=False)[:, 0]
    for ax, name in zip(axes, records, strict=True):
        features = table[table["record"] == name]
        columns, middle = np.arange(len(features)), features["median"]
        look = {"alpha": 0.35, "linewidth": 6, "label": "90 % predicted"}
        ax.vlines(columns, features["q05"] / middle, features["q95"] / middle, color=BLUE, **look)
        if "sim_q05" in features:
            sims = features["sim_q05"] / middle, features["sim_q95"] / middle
            ax.vlines(columns, *sims, color=BLUE, linewidth=2, label="90 % of simulations of the posterior")
        inside, seen = features["inside"].to_numpy(), (features["measured"] / middle).to_numpy()
        ax.plot(columns[inside], seen[inside], "o", color=BLACK, markersize=3.5, label=sensor)
        ax.plot(columns[~inside], seen[~inside], "X", color=VERMILION, markersize=6, label=f"{sensor}, outside")
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("{x:g}" if np.ptp(np.log10(ax.get_ylim())) < 0.7 else "")
        ax.set_ylabel("ratio to the\npredicted median")
        ax.set_title(f"{name}: {inside.sum()} of {len(features)} inside")
        words = [feature_name.replace("_", " ") for feature_name in features["feature"]] if name == records[-1] else []
        ax.set_xticks(columns, words, rotation=60, ha="right")
    figure.legend(*axes[0].get_legend_handles_labels(), ncols=4, loc="outside upper center")
    return figure


@styled
def spectra_figure(pairs: Sequence[tuple[str, float, np.ndarray, np.ndarray]], sensor: str) -> Figure:
    """Amplitude spectra of records and of simulations of the best rig.

    ``pairs`` have the rate of the samples, Hz, and whole turns of ay, g.
    """
    figure = new_figure(0.5 + 1.6 * len(pairs), PAGE)
    axes = figure.subplots(len(pairs), 1, squeeze=False, sharex=True)[:, 0]
    for ax, (name, rate, measured, simulated) in zip(axes, pairs, strict=True):
        for ay, look, label in ((measured, SENSOR, sensor), (simulated, SIMULATION, "best rig, simulated")):
            turns = ay - ay.mean(axis=1, keepdims=True)
            amplitude = np.sqrt(np.mean((2 * np.abs(np.fft.rfft(turns, axis=1)) / turns.shape[1]) ** 2, axis=0))
            hz = np.fft.rfftfreq(turns.shape[1], 1 / rate)
            ax.plot(*thin(hz[1:], amplitude[1:], 800), **look, linewidth=0.7, label=label)
        ax.set(xscale="log", yscale="log", ylim=(1e-4, 3), ylabel="amplitude (g)", title=name)
    axes[-1].set_xlabel("frequency (Hz)")
    axes[0].legend(loc="lower left", ncols=2)
    return figure
