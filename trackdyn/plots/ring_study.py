"""Figures of forces, contact durations and sliding work over the radius of the ring, and the page of a study."""

import base64
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from trackdyn.inputs.files import write_text
from trackdyn.measure.ring_rule import Window, condition_name, conditions
from trackdyn.model.arrays import SIDE_WORDS, SIDES
from trackdyn.plots.rendering import environment
from trackdyn.plots.style import COLOURS, COLUMN, DASHES, GREEN, MARKERS, PAGE, PRINTED, SMALL, new_figure, styled

SIDE_NAMES = dict(zip(SIDE_WORDS, SIDES, strict=True))
SURFACES = {surface: (f"{surface}_sliding_j", f"{surface}_sliding_error_j") for surface in ("teeth", "ring")}
CHOSEN = "recommended"  # mark of the radius that a rule chooses
THICK, DOTTED = {"color": GREEN, "linewidth": 4, "alpha": 0.4}, {"linewidth": 0.8, "linestyle": (0, (1, 2))}


@styled
def figures(
    study: pd.DataFrame, marks: Mapping[str, float], steady: tuple[float, float] | None = None
) -> dict[str, Figure]:
    """Draw figures 23 a, 23 b and 24 of a study; return them by name.

    They show RMS and SD of the normal forces on an appointed connector and link, and contact durations (% of a sprocket
    turn). ``study`` has rows of ``metrics.csv`` for every radius (NaN: no ring) at every speed. ``marks`` are radii (m)
    by name, ``steady`` is a printed left-arc duration (%) and the radius (m) from which it holds.
    """
    drawn = {}
    for letter, statistic, words in (("a", "rms", "RMS"), ("b", "sd", "SD")):
        columns = {name: (f"{side}_{statistic}_n", f"{side}_{statistic}_error_n") for name, side in SIDE_NAMES.items()}
        title = f"{words} of the normal force over the run"
        drawn[f"fig23_{letter}"] = _panels(study, columns, f"{words} of the normal force (N)", title, marks)[0]
    columns = {name: (f"{side}_share_pct", f"{side}_share_error_pct") for name, side in SIDE_NAMES.items()}
    figure, ax, radii = _panels(study, columns, "contact duration (% of a turn)", "Contact duration", marks)
    large = [radius for radius in radii if steady and radius >= steady[1] - 1e-9]
    if steady and large:
        ax.plot([large[0], large[-1]], [steady[0]] * 2, **PRINTED, marker="", linewidth=1.4)
        above = {"xytext": (0, 5), "textcoords": "offset points", "ha": "right"}
        ax.annotate(f"printed: near {steady[0]:g} %", (large[-1], steady[0]), **above)
    return drawn | {"fig24": figure}


@styled
def sliding_figure(study: pd.DataFrame, marks: Mapping[str, float]) -> Figure:
    """Draw the sliding work on the teeth and on the ring in a turn of the sprocket; arguments as of `figures`."""
    return _panels(study, SURFACES, "sliding work (J per turn of the sprocket)", "Sliding work", marks)[0]


@styled
def force_figure(study: pd.DataFrame, limit: float, chosen: float, kept: Sequence[Window]) -> Figure:
    """Draw mean peak forces of a tooth (the larger arc's) and of the ring over its radius; no ring is a line.

    ``study`` is as that of `with_tooth_forces`, ``limit`` the share of the force without a ring that a tooth may bear,
    ``chosen`` the radius of the recommended ring (m; NaN: none). Radii ``kept`` within the limit are shaded.
    """
    figure = new_figure(4.2, PAGE)
    tooth, ring = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    named = list[tuple[float, str, str]]()
    for name, runs, look in _series(study):
        rows, bare = runs.dropna(subset="ring_radius_m"), runs.loc[runs["ring_radius_m"].isna(), "tooth_peak_n"] / 1e3
        for ax, column in ((tooth, "tooth_peak_n"), (ring, "ring_peak_n")):
            error = rows.get(column.replace("_n", "_error_n"), pd.Series(0.0, rows.index)).fillna(0.0)
            ax.errorbar(rows["ring_radius_m"], rows[column] / 1e3, error / 1e3, **look, label=name)
        if len(bare) and (force := float(bare.iloc[0])) > 0:
            tooth.axhline(force, color=look["color"], linewidth=1.6, alpha=0.6)
            named.append((force, f"no ring, {name}", look["color"]))
            tooth.axhline(limit * force, color=look["color"], **DOTTED)
    for ax in (tooth, ring):
        for window in kept:
            # an edge: a window of one radius has no width
            ax.axvspan(window.first, window.last, color=GREEN, alpha=0.18, linewidth=2, zorder=0)
        if chosen == chosen:
            ax.axvline(chosen, **THICK, zorder=1)
        ax.set_ylim(bottom=0)
    height, last = 0.07 * tooth.get_ylim()[1], -np.inf
    for force, name, color in sorted(named):  # lines may lie closer than letters are high
        last = max(force, last + height)
        tooth.annotate(name, (1.01, last), xycoords=("axes fraction", "data"), color=color, fontsize=SMALL, va="center")
    handles, _ = tooth.get_legend_handles_labels()
    handles.append(Line2D([], [], color="0.3", **DOTTED, label=f"{limit:g} of the force without a ring"))
    if kept:
        handles.append(Patch(color=GREEN, alpha=0.18, label="at most that at every speed"))
    if chosen == chosen:
        handles.append(Line2D([], [], **THICK, label=f"{CHOSEN}: {chosen:.4g} m"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=0.9)
    tooth.set(title="Largest force in a passage, mean over passages", ylabel="of a tooth (kN)")
    ring.set(xlabel="radius of the ring (m)", ylabel="of a link on the ring (kN)")
    figure.align_ylabels()
    return figure


def _series(study: pd.DataFrame) -> list[tuple[str, pd.DataFrame, dict[str, Any]]]:
    """Return the rows of every speed and load, by radius, with their names and looks; no ring is first."""
    ordered, series = study.sort_values("ring_radius_m", na_position="first"), []
    for i, (_, rows) in enumerate(ordered.groupby(conditions(study))):
        look = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)], "capsize": 2}
        series.append((condition_name(rows.iloc[0]), rows, look | {"linestyle": DASHES[i % len(DASHES)]}))
    return series


def quiet_from(study: pd.DataFrame, value: str) -> float | None:
    """Return the smallest radius (m) from which on a value is zero at every speed; None if it is not at the largest."""
    largest = study.dropna(subset="ring_radius_m").groupby("ring_radius_m")[value].max().sort_index()
    quiet = (largest[::-1] <= 0).cumprod()[::-1].astype(bool)
    return float(largest.index[quiet].min()) if quiet.any() else None


def _panels(study, columns, unit: str, title: str, marks: Mapping[str, float]) -> tuple[Figure, Axes, list[float]]:
    """Draw a panel for each entry of ``columns``, with a curve for each speed; return the first one and the radii."""
    radii = sorted(study["ring_radius_m"].dropna().unique())
    gaps = np.diff(radii) if len(radii) > 1 else np.array([0.001])
    digits = 3 if np.allclose(radii, np.round(radii, 3), atol=1e-9) else 4
    none = (radii[0] if radii else 0.0) - 1.5 * np.median(gaps)
    with_none = bool(study["ring_radius_m"].isna().any())
    series = _series(study)
    # errors of neighbouring series shall not hide each other
    spread = 0.06 * gaps.min() * (np.arange(len(series)) - 0.5 * (len(series) - 1))
    figure = new_figure(5.0, COLUMN)
    axes = figure.subplots(len(columns), 1, sharex=True)
    lines = list[str]()  # below the legend: text in a panel covers data
    hidden = True  # whether every error bar is smaller than its mark
    for ax, (name, (value, error)) in zip(axes, columns.items(), strict=True):
        for (words, rows, look), aside in zip(series, spread, strict=True):
            bare, position = rows["ring_radius_m"].isna(), rows["ring_radius_m"].fillna(none) + aside
            for drawn, own in ((bare, look | {"linestyle": "none"}), (~bare, look | {"label": words})):
                ax.errorbar(position[drawn], rows.loc[drawn, value], rows.loc[drawn, error].fillna(0.0), **own)
        for mark, radius in marks.items():
            ax.axvline(radius, **THICK if mark == CHOSEN else PRINTED | {"linewidth": 0.6}, zorder=1)
        if with_none and radii:
            ax.axvline(0.5 * (none + radii[0]) - 0.25 * (radii[0] - none), color="0.6", linewidth=0.8)
        ax.set_ylabel(name)
        top = max(ax.get_ylim()[1], 1e-9)
        ax.set_ylim(bottom=-0.05 * top)
        inch = 0.25 * figure.get_figheight() / (1.05 * top)  # height of a unit of the axis; panels are higher than that
        hidden &= bool(study[error].fillna(0.0).max() * inch * 72 * 1.3 < 0.5 * mpl.rcParams["lines.markersize"])
        quiet = quiet_from(study, value)
        if quiet is not None and quiet < radii[-1]:
            lines.append(f"{name}: none from {quiet:.{digits}f} m on")
    largest = study[[error for _, error in columns.values()]].max(axis=None)
    size = f", {largest:.2g} {unit.rpartition('(')[2].rstrip(')')} at most" if largest > 0 else ""
    note = ("standard errors are smaller than the marks" if hidden else "bars: standard errors") + size
    looks = (("green" if mark == CHOSEN else "broken", mark, radius) for mark, radius in marks.items())
    lines = [*(f"{look} line, {radius:.4g} m: {mark}" for look, mark, radius in looks), *lines, note]
    title_of_legend = {"title": "\n".join(textwrap.fill(line, 55) for line in lines), "title_fontsize": SMALL}
    look = {"loc": "outside lower center", "ncols": 4, "columnspacing": 0.8}
    figure.legend(*axes[0].get_legend_handles_labels(), **look, **title_of_legend)
    axes[0].set_title(title)
    figure.supylabel(unit, fontsize=8)
    figure.align_ylabels()
    ticks = ([none] if with_none else []) + radii
    apart, last, names = (ticks[-1] - ticks[0]) / 5 if ticks else 0.0, -np.inf, list[str]()
    for tick in ticks:  # a number has room
        number = "none" if tick == none else f"{tick:.{digits}f}"
        names.append(number if tick - last >= apart else "")
        last = tick if names[-1] else last
    axes[-1].set_xticks(ticks, names)
    axes[-1].set_xlabel("radius of the ring (m)")
    return figure, axes[0], radii


def write_page(path: Path, pictures: Mapping[Path, str], **content) -> None:
    """Write the page of a study (``ring.html.j2``), with pictures (SVG) in it and their captions."""
    embedded = [(base64.b64encode(file.read_bytes()).decode("ascii"), words) for file, words in pictures.items()]
    write_text(path, environment().get_template("ring.html.j2").render(pictures=embedded, **content))
