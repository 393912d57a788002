"""Accuracy against cost: what an answer costs, and whether the planner keeps what it promises."""

from trackdyn.sweeps.job import run_job

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator
from matplotlib.transforms import Bbox

from replication.peers import PEER
from replication.report.marks import handle
from replication.study.accuracy.statistics import LEAD_IN
from replication.study.accuracy.trade import pareto
from trackdyn.files import write_csv
from trackdyn.plots.cells import significant
from trackdyn.plots.style import BLACK, COLOURS, GREEN, PURPLE, SMALL, new_figure, save, styled

LABELS = {
    "rms": "relative error of the RMS",
    "left_peak": "relative error of the mean\nleft-arc peak force",
    "left_share": "error of the left contact\nduration (turns)",
}
METHODS = {"semi_implicit": "semi-implicit Euler", "linearly_implicit": "linearly implicit", "rk4": "RK4"}
PHYSICS = {"spatial": "s", "three_surfaces": "D", "single_pin": "^", "belt": "v"}
FIRST = {"spatial": "in space", "single_pin": "one body a pitch", "belt": "belt"}  # in the picture of the README
PAPERS = 5e-5  # s, the step of the preset `paper`
STARTING = 1.0  # s, the ramp of the scenes
# of a name from its point, in points: beside it, then further and further off
PLACES = ((8, 0), (-8, 0), *((side, lift) for by in range(14, 80, 14) for lift in (by, -by) for side in (6, -6)))
LEAST_ERROR = 1e-6  # what is smaller is drawn there
PEERS_SCENE = "ring 0.308 m 115 rpm"


def answers(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of the study with what the whole answer took, ``cpu_s``: settling, starting, lead-in and record."""
    run = rows["cpu_s_per_s"] * (STARTING + LEAD_IN + rows["record_s"])
    return rows[~rows["failed"].astype(bool)].assign(cpu_s=rows["start_cpu_s"] + run)


def trade_sentence(promises: pd.DataFrame) -> str:
    """CPU seconds of answers to the least tolerance, with the planner's trial, over the scenes kept apart."""
    judged, parts = promises[promises["achieved_error"].notna()], []
    for measure, words in (("rms", "RMS"), ("left_peak", "mean left-arc peak")):
        rows = judged[judged["measure"] == measure]
        rows = rows[rows["tolerance"] == rows["tolerance"].min()]
        if len(rows):
            seconds = rows["cpu_s"] + rows["trial_cpu_s"]
            span = dict.fromkeys(significant(value, 2) for value in (seconds.min(), seconds.max()))
            parts.append(f"{words} to {100 * rows['tolerance'].iloc[0]:g} %: {' to '.join(span)} CPU s")
    scenes = ", ".join(dict.fromkeys(judged["scene"]))
    return f"{'; '.join(parts)} for all links, trial included, on the machine that measured ({scenes})."


@styled
def trade_figure(rows: pd.DataFrame, peers: pd.DataFrame | None = None) -> Figure:
    """Error of three measures against the CPU time of the whole answer, a panel a scene and measure.

    Every setting is a point with its step in ms, the Pareto front a line. Errors below ``LEAST_ERROR`` stand there.
    Coarser physics and motion in space have marks of their own, the paper's step a ring around it; from ``peers``
    (`peers.answers`) come those of Exudyn.
    """
    data = answers(rows)
    measured = set(data.loc[data["measure"] == "rms", "scene"])
    scenes = [scene for scene in dict.fromkeys(data["scene"]) if scene in measured]
    figure = new_figure(2.3 * len(LABELS) + 0.7, 3.1 * len(scenes))
    axes = figure.subplots(len(LABELS), len(scenes), sharex=True, sharey="row", squeeze=False)
    for line, measure in zip(axes, LABELS, strict=True):
        for axis, scene in zip(line, scenes, strict=True):
            here = data[(data["scene"] == scene) & (data["measure"] == measure)]
            _panel(axis, here.assign(error=here["error"].clip(lower=LEAST_ERROR)))
            if peers is not None and scene == PEERS_SCENE and measure == "rms":
                _peers(axis, peers)
            if measure == "rms":
                axis.set_title(scene)
        line[0].set_ylabel(LABELS[measure])
    for axis in axes[-1]:
        axis.set_xlabel("CPU time of the answer (s)")
    handles = [handle(name, color=COLOURS[k], marker="o", lw=0) for k, name in enumerate(METHODS.values())]
    look = {"lw": 0, "markerfacecolor": "none"}
    handles += [handle(name.replace("_", " "), marker=mark, color="0.4", **look) for name, mark in PHYSICS.items()]
    handles.append(handle("the paper's step", marker="o", ms=11, color=BLACK, **look))
    handles.append(handle("Pareto front", color="0.4", lw=0.9))
    if peers is not None:
        handles.append(handle("Exudyn", marker="*", ms=6, lw=0, color=GREEN))
    figure.legend(handles=handles, loc="outside lower center", ncols=7)
    return figure


@styled
def first_figure(rows: pd.DataFrame, promises: pd.DataFrame, peers: pd.DataFrame | None = None) -> Figure:
    """Error of the RMS against the CPU time of the answer in one scene with a ring, every point with its name.

    Of the planner's ``promises`` (`promises.py`) those of the RMS are drawn with their trials, of ``peers``
    (`peers.answers`) the setting of Exudyn that is cheapest for 1 %.
    """
    data = answers(rows)
    here = data[(data["scene"] == PEERS_SCENE) & (data["measure"] == "rms")]
    points = []
    for _, row in here.iterrows():
        full, step = row["fidelity"] == "ten_arcs", row["step_s"]
        if full and row["integrator"] == "semi_implicit" and step < PAPERS * (1 - 1e-9):
            continue  # as RK4 shows, a finer step gains nothing here
        name = METHODS[row["integrator"]] if full else FIRST.get(row["fidelity"])
        if name:
            words = name if np.isnan(step) else f"{name}, {1e3 * step:g} ms"
            if full and row["integrator"] == "semi_implicit" and np.isclose(step, PAPERS):
                words = f"the paper's step, {1e3 * step:g} ms"
            colour = COLOURS[list(METHODS).index(row["integrator"])] if full else "0.35"
            points.append((row["cpu_s"], row["error"], words, colour, "o" if full else PHYSICS[row["fidelity"]]))
    planned = promises[(promises["measure"] == "rms") & promises["achieved_error"].notna()]
    for _, row in planned.sort_values("tolerance").head(1).iterrows():
        words = f"--tolerance {100 * row['tolerance']:g}%, its trial included"
        points.append((row["cpu_s"] + row["trial_cpu_s"], row["achieved_error"], words, PURPLE, "P"))
    if peers is not None:
        for _, row in peers[(peers["code"] == PEER) & (peers["chosen"] == "yes")].iterrows():
            words = f"Exudyn at its best, {1e3 * row['step_s']:g} ms"
            points.append((row["cpu_s"], abs(row["difference_pct"]) / 100, words, GREEN, "*"))
    figure = new_figure(3.2)
    axis = figure.subplots()
    points = sorted((x, max(error, LEAST_ERROR), *look) for x, error, *look in points)
    for x, error, _, colour, mark in points:
        axis.loglog(x, error, mark, color=colour, ms=6, mfc=colour if mark in "oP*" else "none")
    ends = axis.get_xlim()
    axis.set_xlim(min(0.1, ends[0]), max(20.0, ends[1]))
    axis.xaxis.set_major_locator(FixedLocator([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_locator(NullLocator())
    axis.margins(y=0.15)
    axis.set_xlabel("CPU time of the answer (s)")
    axis.set_ylabel("relative error of the RMS")
    axis.set_title(PEERS_SCENE)
    _name_points(axis, points)
    return figure


def _name_points(axis: Axes, points: Sequence[tuple]) -> None:
    """Write the name of every point (x, y, words, colour, mark) where it covers no other name and no point."""
    figure = axis.figure
    figure.draw_without_rendering()
    space, renderer = axis.get_window_extent(), figure.canvas.get_renderer()
    size, points_px = 5.0 * figure.dpi / 72, axis.transData.transform([point[:2] for point in points])
    marks = [Bbox.from_bounds(x - size, y - size, 2 * size, 2 * size) for x, y in points_px]
    names: list[Bbox] = []
    for (x, y, words, colour, _), point, own_mark in zip(points, points_px, marks, strict=True):
        for dx, dy in PLACES:
            text = axis.annotate(
                words, (x, y), (dx, dy), textcoords="offset points", fontsize=SMALL, color=colour, va="center",
                ha="left" if dx > 0 else "right", in_layout=False,
                arrowprops={"arrowstyle": "-", "lw": 0.5, "color": colour, "shrinkB": 3} if dy else None,
            )  # fmt: skip
            text.update_positions(renderer)
            box = Text.get_window_extent(text, renderer)  # without the line to its point
            line = Path([point, box.get_points().mean(axis=0)])
            crossed = any(line.intersects_bbox(mark) for mark in marks if not mark.overlaps(own_mark))
            inside = space.x0 < box.x0 < box.x1 < space.x1 and space.y0 < box.y0 < box.y1 < space.y1
            if inside and not crossed and not box.count_overlaps(names + marks):
                break
            text.set_visible(False)
        text.set_visible(True)
        names.append(box)


def _panel(axis: Axes, here: pd.DataFrame) -> None:
    for _, row in here.iterrows():
        full = row["fidelity"] == "ten_arcs"
        colour = COLOURS[list(METHODS).index(row["integrator"])] if full else "0.4"
        mark = "o" if full else PHYSICS[row["fidelity"]]
        axis.loglog(row["cpu_s"], row["error"], mark, color=colour, markersize=4, mfc=colour if full else "none")
        if full:
            look = {"textcoords": "offset points", "fontsize": SMALL, "color": colour, "ha": "center"}
            above = 5 if row["integrator"] == "semi_implicit" else -11
            axis.annotate(f"{1e3 * row['step_s']:g}", (row["cpu_s"], row["error"]), (0, above), **look)
            if row["integrator"] == "semi_implicit" and np.isclose(row["step_s"], PAPERS):
                axis.plot(row["cpu_s"], row["error"], "o", ms=11, color=BLACK, mfc="none", mew=0.8)
    front = pareto(here)
    axis.step(front["cpu_s"], front["error"], where="post", color="0.4", lw=0.9, zorder=0)
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.margins(0.12, 0.15)
    axis.grid(True, which="major", lw=0.3)


def _peers(axis: Axes, peers: pd.DataFrame) -> None:
    """Answers of Exudyn; those on its Pareto front have their step."""
    known = peers[(peers["code"] == PEER) & peers["cpu_s"].notna()]
    rows = known.assign(error=(known["difference_pct"].abs() / 100).clip(lower=LEAST_ERROR))
    axis.plot(rows["cpu_s"], rows["error"], "*", ms=6, color=GREEN)
    look = {"textcoords": "offset points", "fontsize": SMALL, "color": GREEN}
    for _, row in pareto(rows).iterrows():
        axis.annotate(f"{1e3 * row['step_s']:g}", (row["cpu_s"], row["error"]), (4, 3), **look)


def main(job) -> None:
    """Rule `trade_form`."""
    inputs, out = job.input, job.output
    rows, promises = (
        pd.concat(map(pd.read_csv, paths), ignore_index=True) for paths in (inputs.parts, inputs.promises)
    )
    write_csv(out.csv, rows)
    write_csv(out.planner, promises)
    peers = pd.read_csv(inputs.peers[0]) if inputs.peers else None
    save(trade_figure(rows, peers), out.figure[0])
    save(first_figure(rows, promises, peers), out.first[0])


if __name__ == "__main__":
    run_job(main)
