"""Accuracy against cost: work-precision figures, cost of an answer, test of the planner."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from replication.study.accuracy.limit import SURE
from replication.study.accuracy.planner import LEAST, LONGEST, record_error, seconds_of
from replication.study.accuracy.trade import pareto
from trackdyn.plots.style import BLUE, COLOURS, SMALL, VERMILION, new_figure, styled

LABELS = {
    "state_m": "largest position error of a mass centre after 0.1 s (m)",
    "rms": "relative error of the RMS",
    "sd": "relative error of the SD",
    "left_share": "error of the left contact duration (turns)",
    "ring_share": "error of the ring contact duration (turns)",
    "high_frequency": "relative error of the RMS at and above 20 Hz",
    "left_peak": "relative error of the mean left-arc peak force",
    "right_peak": "relative error of the mean right-arc peak force",
}
METHODS = {
    "semi_implicit": "semi-implicit Euler", "linearly_implicit": "linearly implicit",
    "rk4": "RK4", "adaptive": "adaptive 5(4)",
}  # fmt: skip
PHYSICS = {"ten_arcs": "o", "three_surfaces": "s", "single_pin": "^", "elastic_cut": "D"}
NEGLIGIBLE = 0.1  # errors below this part of the fifth percentile are drawn there, as arrows: they stretch the axis
FRONT = {"color": "0.75", "lw": 4.0}
TINY = {"linestyle": "none", "marker": "$\\downarrow$", "color": "0.4", "markersize": 6}


def spoken(measure: str) -> str:
    """A measure in words."""
    return {"rms": "RMS", "sd": "SD"}.get(measure, measure.replace("_", " "))


def drawn_errors(errors: pd.Series) -> tuple[pd.Series, float]:
    """Errors as they are drawn on a logarithmic axis, and the floor at which those that are next to nothing stand."""
    floor = (
        NEGLIGIBLE * float(np.quantile(errors[errors > 0], 0.05, method="lower")) if (errors > 0).any() else NEGLIGIBLE
    )
    return errors.clip(lower=floor), floor


def _panels(rows: pd.DataFrame) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel for every scene of a table, two in a line."""
    scenes = list(dict.fromkeys(rows["scene"]))
    columns = min(len(scenes), 2)
    lines = -(-len(scenes) // columns)
    figure = new_figure(1.2 + 2.0 * lines)
    axes = figure.subplots(lines, columns, sharey=True, sharex=True, squeeze=False)
    for unused in axes.flat[len(scenes) :]:
        unused.set_axis_off()
    return figure, dict(zip(scenes, axes.flat, strict=False))


@styled
def work_precision(rows: pd.DataFrame, measure: str) -> Figure:
    """Error of a measure against CPU time per simulated second, one panel per scene, with the Pareto front."""
    chosen = rows[rows["measure"] == measure]
    figure, panels = _panels(chosen)
    error, floor = drawn_errors(chosen["error"])
    for scene, axis in panels.items():
        here = chosen[chosen["scene"] == scene]
        for (fidelity, method), group in here.groupby(["fidelity", here["integrator"].str.split().str[0]], sort=False):
            colour = COLOURS[list(METHODS).index(method)]
            look = {"color": colour, "markerfacecolor": colour if fidelity == "ten_arcs" else "none", "markersize": 5}
            axis.loglog(group["cpu_s_per_s"], error[group.index], PHYSICS[fidelity], **look)
        tiny = here[here["error"] < floor]
        axis.plot(tiny["cpu_s_per_s"], 0.6 * error[tiny.index], **TINY)
        front = pareto(here)
        axis.step(front["cpu_s_per_s"], error[front.index], where="post", color="0.4", lw=0.8, zorder=0)
        refused = int((rows["failed"].astype(bool) & (rows["scene"] == scene)).sum())
        axis.set_title(scene + (f"\nrefused or diverged: {refused}" if refused else ""))
        axis.set_xlabel("CPU time per simulated second (s)")
        axis.tick_params(labelbottom=True)
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.grid(True, which="major", lw=0.3)
    figure.supylabel(LABELS.get(measure, measure), fontsize=8)
    used = set(chosen["integrator"].str.split().str[0])
    handles = _methods(used, marker="o", linestyle="")
    handles += [
        Line2D([], [], marker=mark, linestyle="", color="0.4", markerfacecolor="none", label=name.replace("_", " "))
        for name, mark in PHYSICS.items()
        if name != "ten_arcs" and name in set(chosen["fidelity"])
    ]
    handles.append(Line2D([], [], color="0.4", lw=0.8, label="Pareto front"))
    if (chosen["error"] < floor).any():
        handles.append(Line2D([], [], **TINY, label=f"below {floor:.0e}"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _methods(used: set[str], **look) -> list[Line2D]:
    """An entry of the legend for every method that is used."""
    return [
        Line2D([], [], color=COLOURS[k], label=name, **look)
        for k, (method, name) in enumerate(METHODS.items())
        if method in used
    ]


@styled
def answer_figure(rows: pd.DataFrame, measure: str) -> Figure:
    """Upper bound of the error of an answer against its CPU time, one panel per scene.

    One curve per setting: its error and the scatter of a record that grows from nine passages to ten minutes. The
    lower envelope is the Pareto front.
    """
    chosen = rows[(rows["measure"] == measure) & ~rows["failed"].astype(bool) & rows["scatter"].notna()]
    figure, panels = _panels(chosen)
    for scene, axis in panels.items():
        costs, errors = [], []
        for _, row in chosen[chosen["scene"] == scene].iterrows():
            passages = np.unique(np.geomspace(LEAST, max(LONGEST / row["passage_s"], LEAST), 60).astype(int))
            cost = seconds_of(row["start_cpu_s"], row["cpu_s_per_s"], (passages + row["unused"]) * row["passage_s"])
            error = row["error"] + SURE * row["uncertainty"] + record_error(row["scatter"], passages)
            # half widths jump where passages make another number of batches: what was reached is not lost
            error = np.minimum.accumulate(error)
            colour = COLOURS[list(METHODS).index(row["integrator"])]
            full = row["fidelity"] == "ten_arcs"
            axis.loglog(cost, error, "-" if full else ":", color=colour, lw=0.8)
            axis.plot(
                cost[[0, -1]],
                error[[0, -1]],
                PHYSICS[row["fidelity"]],
                color=colour,
                ms=3,
                mfc=colour if full else "none",
            )
            costs.append(cost)
            errors.append(error)
        order = np.argsort(np.concatenate(costs))
        best = np.minimum.accumulate(np.concatenate(errors)[order])
        axis.step(np.concatenate(costs)[order], best, where="post", **FRONT, zorder=0)
        axis.set_title(scene)
        axis.set_xlabel("CPU time (s)")
        axis.tick_params(labelbottom=True)
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.grid(True, which="major", lw=0.3)
    figure.supylabel("upper bound, " + LABELS.get(measure, measure), fontsize=8)
    handles = _methods(set(chosen["integrator"]))
    if set(chosen["fidelity"]) - {"ten_arcs"}:
        handles.append(Line2D([], [], color="0.4", linestyle=":", label="coarser physics"))
    handles.append(Line2D([], [], **FRONT, label="Pareto front"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


@styled
def planner_figure(table: pd.DataFrame) -> Figure:
    """Achieved error against tolerance on scenes outside the data; missed tolerances are labelled."""
    figure = new_figure(4.2)
    axis = figure.subplots()
    known = table[table["achieved_error"].notna()]
    error, floor = drawn_errors(known["achieved_error"])
    measures = list(known["measure"].unique())
    place = known["tolerance"] * 10 ** (0.025 * (known["measure"].map(measures.index) - 0.5 * (len(measures) - 1)))
    met = known["met"].astype(bool)
    for k, measure in enumerate(measures):
        look = {"marker": "osD^v<>"[k % 7], "ms": 4, "linestyle": "none"}
        for kept, colour in ((True, BLUE), (False, VERMILION)):
            here = (known["measure"] == measure) & (met == kept)
            label = spoken(measure) if kept else None
            axis.loglog(place[here], error[here], **look, color=colour, label=label)
    for index, row in known[~met].iterrows():
        text = f"missed: {spoken(row['measure'])}\n{row['achieved_error']:.2g} at {row['tolerance']:g}"
        look = {"textcoords": "offset points", "ha": "left", "fontsize": SMALL, "color": VERMILION}
        axis.annotate(text, (place[index], error[index]), (-4, 9), **look)
    tolerances = sorted(known["tolerance"].unique())
    ends = np.array([known["tolerance"].min() * 0.7, known["tolerance"].max() * 1.4])
    axis.loglog(ends, ends, "k-", lw=1, label="tolerance")
    axis.set_xticks(tolerances, [f"{t:g}" for t in tolerances])
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set(xlabel="tolerance (relative; turns for contact durations)", ylabel="achieved error (same unit)")
    tiny = f"; errors below {floor:.0e} are drawn at that value" if (known["achieved_error"] < floor).any() else ""
    axis.set_title(f"{int(met.sum())} of {len(known)} tolerances met{tiny}")
    figure.legend(loc="outside lower center", ncols=4)
    axis.grid(True, lw=0.3)
    return figure
