"""Accuracy against cost (work-precision), and the planner's promises."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, NullLocator
from matplotlib.transforms import Bbox

from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import NAMED
from trackdyn.measure.columns import significant
from trackdyn.plots.style import COLOURS, GREEN, PURPLE, SMALL, new_figure, save, styled
from trackdyn.scene.choices import PRESETS
from trackdyn_replication.study.accuracy.record_statistics import LEAD_IN
from trackdyn_replication.study.settings import PICTURED, scene_name
from trackdyn_replication.study.variants import METHOD_WORDS, PHYSICS_WORDS, REFERENCE

MARKS = {"spatial": "s", "single_pin": "^", "belt": "v"}  # marks of the coarser physics that are drawn
PAPERS = PRESETS[REFERENCE]["step"]  # s, of our preset; the paper prints no step
STARTING = 1.0  # s, the ramp of the scenes
# offsets of a name from its point, in points, the closest first
PLACES = ((8, 0), (-8, 0), *((side, lift) for by in range(14, 80, 14) for lift in (by, -by) for side in (6, -6)))
PLANNED = {"rms": "an RMS", "left_peak": "a mean peak force of the left arc"}  # names of measures
LEAST_ERROR = 1e-6  # smaller errors are drawn there


def answers(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows of the study with the cost of the whole answer, ``cpu_s``: settling, start-up, lead-in and record."""
    run = rows["cpu_s_per_s"] * (STARTING + LEAD_IN + rows["record_s"])
    return rows[~rows["failed"].astype(bool)].assign(cpu_s=rows["start_cpu_s"] + run)


def trade_sentence(promises: pd.DataFrame) -> str:
    """Return a sentence on CPU seconds of answers to the least tolerance, with the planner's trial."""
    judged, parts = promises[promises["achieved_error"].notna()], []
    for measure, words in PLANNED.items():
        rows = judged[judged["measure"] == measure]
        rows = rows[rows["tolerance"] == rows["tolerance"].min()]
        if len(rows):
            seconds = rows["cpu_s"] + rows["trial_cpu_s"]
            span = dict.fromkeys(significant(value, 2) for value in (seconds.min(), seconds.max()))
            parts.append(f"{words} to {100 * rows['tolerance'].iloc[0]:g} % costs {' to '.join(span)} CPU s")
    scenes = "; ".join(dict.fromkeys(judged["scene"]))
    costs = " and ".join(parts)
    text = f"{costs[0].upper()}{costs[1:]}, for all links and with the choice of the step (one machine, {scenes})."
    return " ".join(filter(None, (text, same_answer(judged[judged["measure"] == "rms"]))))


def promises_sentence(promises: pd.DataFrame) -> str:
    """Return a sentence on the tolerances that the planner met, and on each that it did not."""
    judged = promises.dropna(subset="met")
    broken = judged[~judged["met"].astype(bool)]
    refused = f", and refused {len(promises) - len(judged)}" if len(judged) < len(promises) else ""
    misses = [
        f"Not met: {NAMED[name].studied.words} to {100 * tolerance:g} %, error {100 * error:.2g} %."
        for name, tolerance, error in broken[["measure", "tolerance", "achieved_error"]].itertuples(index=False)
    ]
    scenes = "; ".join(dict.fromkeys(promises["scene"]))
    counts = f"{len(judged) - len(broken)} of {len(judged)} tolerances{refused}"
    met = f"On a scene kept apart ({scenes}), the planner of `trackdyn simulate --tolerance` met {counts}."
    return " ".join(filter(None, (met, *misses, same_answer(judged[judged["measure"] == "rms"]))))


def same_answer(rows: pd.DataFrame) -> str:
    """Return a sentence on the largest tolerances if the planner picks one step for them; else an empty string."""
    if len(rows) < 2:
        return ""
    rows = rows.sort_values("tolerance", ascending=False)
    same = rows[rows["step_s"].eq(rows["step_s"].iloc[0]).cumprod().astype(bool)]
    if len(same) < 2:
        return ""
    least, worst = same["tolerance"].iloc[-1], same["achieved_error"].max()
    return (
        f"A tolerance of {100 * least:g} % or more gets one answer, a step of {1e3 * same['step_s'].iloc[0]:g} ms: its "
        f"RMS is within {100 * worst:.2g} %."
    )


@styled
def trade_figure(rows: pd.DataFrame, promises: pd.DataFrame) -> Figure:
    """Draw the error of the RMS over the CPU time of answers with a ring, and below the planner's ``promises``."""
    data, pictured = answers(rows), scene_name(*PICTURED)
    pictured_rows = data[(data["scene"] == pictured) & (data["measure"] == "rms")]
    points = []
    for _, row in pictured_rows.iterrows():
        full, step = row["fidelity"] == "ten_arcs", row["step_s"]
        if full and row["integrator"] == "semi_implicit" and step < PAPERS * (1 - 1e-9):
            continue  # as RK4 shows, a finer step gains nothing here
        mark = "o" if full else MARKS.get(row["fidelity"])
        if mark:
            name = METHOD_WORDS[row["integrator"]] if full else PHYSICS_WORDS[row["fidelity"]]
            words = name if np.isnan(step) else f"{name}, {1e3 * step:g} ms"
            if full and row["integrator"] == "semi_implicit" and np.isclose(step, PAPERS):
                words = f"preset {REFERENCE}, {1e3 * step:g} ms"
            colour = COLOURS[list(METHOD_WORDS).index(row["integrator"])] if full else "0.35"
            points.append((row["cpu_s"], row["error"], words, colour, mark))
    figure = new_figure(4.6)
    axis, planned = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    points = sorted((x, max(error, LEAST_ERROR), *look) for x, error, *look in points)
    for x, error, _, colour, mark in points:
        axis.loglog(x, 100 * error, mark, color=colour, ms=6, mfc=colour if mark == "o" else "none")
    ends = axis.get_xlim()
    answered = promises[promises["achieved_error"].notna()]
    dearest = (answered["cpu_s"] + answered["trial_cpu_s"]).max()
    axis.set_xlim(min(0.1, ends[0]), np.nanmax([20.0, ends[1], 1.6 * dearest]))  # with the name of the dearest inside
    axis.xaxis.set_major_locator(FixedLocator([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_locator(NullLocator())
    axis.margins(y=0.15)
    axis.yaxis.set_major_formatter(lambda percent, _: f"{percent:g}")
    axis.set(ylabel="error of the RMS (%)", title=f"Model, method and step ({pictured})")
    _draw_planned(planned, answered)
    planned.set_xlabel("CPU time of the answer (s)")
    figure.legend(loc="outside lower center", ncols=2)
    _name_points(axis, [(x, 100 * error, *look) for x, error, *look in points])
    return figure


def _draw_planned(axis: Axes, promises: pd.DataFrame) -> None:
    """Draw the planner's cost for each tolerance, its trial included, and the step that it picks."""
    tolerances = sorted(promises["tolerance"].unique())
    for (measure, words), mark, colour in zip(PLANNED.items(), "PD", (PURPLE, GREEN), strict=True):
        rows = promises[promises["measure"] == measure]
        axis.plot([], [], mark, color=colour, label=words)
        lift = 9 if measure == "rms" else -9  # names of one tolerance lie on both sides of its line
        for row in rows.itertuples():
            at, near = (row.cpu_s + row.trial_cpu_s, tolerances.index(row.tolerance)), {"ha": "center", "va": "center"}
            axis.plot(*at, mark, color=colour, ms=6)
            near |= {"textcoords": "offset points", "color": colour, "fontsize": SMALL}
            axis.annotate(f"{1e3 * row.step_s:g} ms", at, (0, lift), **near)
    axis.set_yticks(range(len(tolerances)), [f"{100 * tolerance:g} %" for tolerance in tolerances])
    axis.margins(y=0.25)
    title = f"What --tolerance picks, and its whole cost ({'; '.join(promises['scene'].unique())})"
    axis.set(ylabel="tolerance", title=title)


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


@run_job
def main(job) -> None:
    """Rule `trade`."""
    inputs, out = job.input, job.output
    rows, promises = (
        pd.concat(map(pd.read_csv, paths), ignore_index=True) for paths in (inputs.parts, inputs.promises)
    )
    write_csv(out.csv, rows)
    write_csv(out.planner, promises)
    save(trade_figure(rows, promises), out.figure[0])
