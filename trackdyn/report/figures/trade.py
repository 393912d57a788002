"""Accuracy against cost: the work-precision figures, the scaling of the sweep, the planner's honesty."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from trackdyn.report.style import COLOURS, new_figure, styled
from trackdyn.study.accuracy.trade import pareto

LABELS = {
    "state_m": "largest error of a mass centre after 0.1 s (m)",
    "rms": "error of RMS (1)",
    "sd": "error of SD (1)",
    "left_share": "error of the left arc's share (turns)",
    "ring_share": "error of the ring's share (turns)",
    "left_peak": "error of the left arc's mean peak (1)",
}
METHODS = {
    "semi_implicit": "semi-implicit Euler", "linearly_implicit": "linearly implicit",
    "rk4": "RK4", "adaptive": "adaptive 5(4)",
}  # fmt: skip
PHYSICS = {"ten_arcs": "o", "three_surfaces": "s", "single_pin": "^", "elastic_cut": "D"}
# errors of exactly zero are drawn here
LEAST = 1e-12


@styled
def work_precision(rows: pd.DataFrame, measure: str) -> Figure:
    """One panel a scene: error of a measure against wall seconds per simulated second, with the Pareto front."""
    chosen = rows[rows["measure"] == measure]
    scenes = list(dict.fromkeys(chosen["scene"]))
    columns = min(len(scenes), 3)
    lines = -(-len(scenes) // columns)
    figure = new_figure(1.0 + 2.6 * lines)
    axes = figure.subplots(lines, columns, sharey=True, sharex=True, squeeze=False)
    for unused in axes.flat[len(scenes) :]:
        unused.set_axis_off()
    for axis, scene in zip(axes.flat, scenes, strict=False):
        here = chosen[chosen["scene"] == scene]
        for (fidelity, method), group in here.groupby(["fidelity", here["integrator"].str.split().str[0]], sort=False):
            colour = COLOURS[list(METHODS).index(method)]
            look = {"color": colour, "markerfacecolor": colour if fidelity == "ten_arcs" else "none", "markersize": 5}
            axis.loglog(group["wall_s_per_s"], group["error"].clip(lower=LEAST), PHYSICS[fidelity], **look)
        front = pareto(here)
        axis.step(front["wall_s_per_s"], front["error"].clip(lower=LEAST), where="post", color="0.4", lw=0.8, zorder=0)
        if refused := int((rows["failed"].astype(bool) & (rows["scene"] == scene)).sum()):
            look = {"transform": axis.transAxes, "ha": "right", "va": "top", "fontsize": 7, "color": "0.3"}
            axis.text(0.98, 0.98, f"refused or diverged: {refused}", **look)
        axis.set_title(scene, fontsize=9)
        axis.set_xlabel("wall s per simulated s")
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.grid(True, which="major", lw=0.3)
    figure.supylabel(LABELS.get(measure, measure), fontsize=9)
    used = set(chosen["integrator"].str.split().str[0])
    handles = [
        Line2D([], [], marker="o", linestyle="", color=COLOURS[k], label=name)
        for k, (method, name) in enumerate(METHODS.items())
        if method in used
    ]
    handles += [
        Line2D([], [], marker=mark, linestyle="", color="0.4", markerfacecolor="none", label=name.replace("_", " "))
        for name, mark in PHYSICS.items()
        if name != "ten_arcs" and name in set(chosen["fidelity"])
    ]
    handles.append(Line2D([], [], color="0.4", lw=0.8, label="nothing is better in both"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7)
    return figure


@styled
def scaling_figure(table: pd.DataFrame) -> Figure:
    """Wall time of equal runs on one and two processes beside the model."""
    figure = new_figure(3.2)
    axis = figure.subplots()
    for k, (processes, group) in enumerate(table.groupby("processes")):
        name = f"{processes} process{'es' if processes > 1 else ''}"
        dashes = "-" if k == 0 else "--"
        axis.plot(group["jobs"], group["wall_s"], "os"[k % 2], color=COLOURS[k], label=name)
        axis.plot(group["jobs"], group["model_s"], dashes, color=COLOURS[k], lw=1, label=f"{name}, model")
    axis.set(xlabel="runs", ylabel="wall time (s)")
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=7)
    axis.grid(True, lw=0.3)
    return figure


@styled
def planner_figure(table: pd.DataFrame) -> Figure:
    """Achieved error against promised tolerance on scenes that the data do not hold."""
    figure = new_figure(3.6)
    axis = figure.subplots()
    known = table[table["achieved_error"].notna()]
    for k, (measure, group) in enumerate(known.groupby("measure", sort=False)):
        offset = 10 ** (0.02 * (k - 3))
        look = {"marker": "osD^v<>"[k % 7], "ms": 4, "linestyle": "none", "color": COLOURS[k % len(COLOURS)]}
        error = group["achieved_error"].clip(lower=1e-6)
        axis.loglog(group["tolerance"] * offset, error, **look, label=measure.replace("_", " "))
    tolerances = sorted(known["tolerance"].unique())
    ends = np.array([known["tolerance"].min() * 0.7, known["tolerance"].max() * 1.4])
    axis.loglog(ends, ends, "k-", lw=1, label="promised")
    axis.set_xticks(tolerances, [f"{t:g}" for t in tolerances])
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set(xlabel="tolerance (1, or turns for shares)", ylabel="achieved error")
    axis.legend(fontsize=7, ncols=2)
    axis.grid(True, lw=0.3)
    return figure
