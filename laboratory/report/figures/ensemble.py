"""Rigs of an ensemble: Figures 23 and 24 with bands, what excludes what, what is tied to what, which ring to choose."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from laboratory.inference.ensemble.ring_choice import CRITERIA
from replication.paper import printed
from trackdyn.plots.style import BLACK, BLUE, COLOURS, DASHES, MARKERS, ORANGE, PRINTED, VERMILION, new_figure, styled

SIDES = {"left": "left arc", "right": "right arc", "ring": "ring"}
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LEAST_DRAWN = 0.3  # implausibilities below are drawn there: the axes are logarithmic
CLAIM_MOST = 12.0  # implausibilities beyond share the last shade
CELL = {"ha": "center", "va": "center", "fontsize": 7}


@styled
def band_figure(runs: pd.DataFrame, column: str, unit: str, title: str, shipped: pd.DataFrame | None = None) -> Figure:
    """A measure of each side over the rigs against the radius of the ring.

    ``runs`` have columns ``rig, rpm, ring_radius_m`` and ``<side>_<column>``; ``shipped`` are rows of ``metrics.csv``,
    drawn on top.
    """
    runs = runs[runs["ring_radius_m"].notna()]
    figure = new_figure(6.0)
    axes = figure.subplots(3, 1, sharex=True)
    for ax, (side, words) in zip(axes, SIDES.items(), strict=True):
        for i, (rpm, of) in enumerate(runs.groupby("rpm")):
            q = of.groupby("ring_radius_m")[f"{side}_{column}"].quantile(QUANTILES).unstack()
            look = {"color": COLOURS[(i + 1) % len(COLOURS)]}
            ax.fill_between(q.index, q[0.05], q[0.95], alpha=0.15, linewidth=0, **look)
            ax.fill_between(q.index, q[0.25], q[0.75], alpha=0.3, linewidth=0, **look)
            look |= {"marker": MARKERS[i % 4], "linestyle": DASHES[i % 4], "label": f"{rpm:g} rpm, median"}
            ax.plot(q.index, q[0.5], **look)
        if shipped is not None:
            slowest = runs["rpm"].min()
            rows = shipped[shipped["ring_radius_m"].notna() & (shipped["rpm"] == slowest)].sort_values("ring_radius_m")
            look = {"color": BLACK, "linestyle": "--", "label": f"shipped rig, {slowest:g} rpm"}
            ax.plot(rows["ring_radius_m"], rows[f"{side}_{column}"], **look)
        ax.axvline(printed.RADIUS_CHOSEN.value, **PRINTED, linewidth=0.6, zorder=1)
        ax.set_ylabel(words)
        ax.set_ylim(min(0.0, ax.get_ylim()[0]), 1.05 * max(ax.get_ylim()[1], 1e-9))
    handles, labels = axes[0].get_legend_handles_labels()
    note = f"bands: half and 90 % of {runs['rig'].nunique()} rigs; broken line: 0.308 m, printed"
    figure.legend(handles, labels, loc="outside lower center", ncols=3, title=note, title_fontsize=7)
    axes[0].set_title(title)
    figure.supylabel(unit, fontsize=8)
    axes[-1].set_xlabel("radius of the ring (m)")
    return figure


@styled
def conflict_figure(conflicts: pd.DataFrame, cutoff: float) -> Figure:
    """For every claim and pair of claims the nearest approach of the rigs that ran and of the searches aimed at it."""
    sets = {tuple(row.claims.split()): row for row in conflicts.itertuples() if row.size <= 2}
    names = [claims[0] for claims in sets if len(claims) == 1]
    grid = pd.DataFrame(np.nan, names, names)
    for claims, row in sets.items():
        grid.loc[claims[-1], claims[0]] = np.fmin(row.sample, row.search)
    values = grid.to_numpy()
    figure = new_figure(0.34 * len(names) + 1.7)
    ax = figure.subplots()
    ax.imshow(np.minimum(values, CLAIM_MOST), cmap="Blues", vmin=0, vmax=CLAIM_MOST, aspect="auto")
    for i, j in zip(*np.nonzero(np.isfinite(values)), strict=True):
        lost = values[i, j] > cutoff
        colour = "white" if values[i, j] > 0.6 * CLAIM_MOST else "black"
        ax.text(j, i, f"{values[i, j]:.1f}", **CELL, weight="bold" if lost else "normal", color=colour)
    for i, j in zip(*np.nonzero(np.isinf(values)), strict=True):
        ax.text(j, i, "none", **CELL, weight="bold")
    ax.set_xticks(range(len(names)), names, rotation=50, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(len(names)), names)
    ax.grid(False)
    ax.set_title(
        f"How near the best rig comes to two claims at once\n(implausibility; bold beyond {cutoff:g}: "
        "shown by no rig that ran and no search)"
    )
    return figure


@styled
def pareto_figure(
    worst: pd.DataFrame, front: pd.DataFrame, cutoff: float, first: str = "C16", second: str = "C17"
) -> Figure:
    """Every rig by how far it is from two claims, and those of which none is nearer to both."""
    figure = new_figure(3.6)
    ax = figure.subplots()
    seen = worst[np.isfinite(worst[[first, second]]).all(axis=1)].clip(lower=LEAST_DRAWN)
    front = front.reindex(columns=[first, second]).clip(lower=LEAST_DRAWN)
    look = {"color": "0.65", "markersize": 3, "linestyle": "none", "label": f"{len(seen)} rigs with all contacts"}
    ax.plot(seen[first], seen[second], ".", **look)
    look = {"marker": "o", "color": VERMILION, "linestyle": "-", "drawstyle": "steps-post", "label": "Pareto front"}
    ax.plot(front[first], front[second], **look)
    ax.axvline(cutoff, **PRINTED, linewidth=0.8)
    ax.axhline(cutoff, **PRINTED, linewidth=0.8, label=f"cutoff {cutoff:g}")
    ax.set(xscale="log", yscale="log", xlabel=f"largest implausibility by targets of {first} (no ring)")
    ax.set_ylabel(f"by targets of {second} (ring)")
    ax.legend()
    ax.set_title(f"{first} against {second}")
    return figure


@styled
def pairs_figure(points: pd.DataFrame, prior: pd.DataFrame, names: list[str]) -> Figure:
    """Positions of the rigs in the ranges of some unknowns, pair by pair, and their distributions; 0 to 1 is
    the range.
    """
    count = len(names)
    figure = new_figure(0.95 * count + 0.6, 0.95 * count + 0.9)
    axes = figure.subplots(count, count, sharex=True, squeeze=False)
    words = [name.replace("_contact", "").replace(".", "\n").replace("_", " ") for name in names]
    for i, j in np.ndindex(count, count):
        ax = axes[i, j]
        if j > i:
            ax.set_axis_off()
            continue
        if i == j:
            ax.hist([prior[names[i]], points[names[i]]], bins=np.linspace(0, 1, 9), density=True, color=["0.8", BLUE])
        else:
            ax.plot(prior[names[j]], prior[names[i]], ".", color="0.8", markersize=2, linestyle="none")
            ax.plot(points[names[j]], points[names[i]], ".", color=BLUE, markersize=4, linestyle="none")
            ax.set_ylim(0, 1)
        ax.set_xlim(0, 1)
        ax.set_yticks([])
        ax.set_xticks([0, 1])
        if i == count - 1:
            ax.set_xlabel(words[j], fontsize=7)
        if j == 0:
            ax.set_ylabel(words[i], fontsize=7, rotation=0, ha="right", va="center")
    title = f"{len(points)} rigs (blue) and the first wave (grey)\nwithin the ranges of the parameters"
    figure.suptitle(title, x=0.01, ha="left")
    return figure


@styled
def choice_figure(table: pd.DataFrame, rpm: float) -> Figure:
    """Share of rigs in which a radius leaves the right arc free and in which it is the best one, and sliding work."""
    figure = new_figure(6.0)
    free, best, work = figure.subplots(3, 1, sharex=True)
    radii = table["ring_radius_m"]
    ends = [
        (table["p_right_free"] - table["p_right_free_low"]).clip(lower=0),
        (table["p_right_free_high"] - table["p_right_free"]).clip(lower=0),
    ]
    bars = 100 * np.array(ends) if table["passing"].all() else None
    free.errorbar(radii, 100 * table["p_right_free"], bars, color=BLACK, marker="o", capsize=2, linestyle="-")
    free.set(ylabel="right arc free (%)", ylim=(-5, 105))
    for i, name in enumerate(CRITERIA):
        look = {"color": COLOURS[i % 4], "marker": MARKERS[i % 4], "linestyle": DASHES[i % 4], "label": name}
        best.plot(radii, 100 * table[f"p_best_{name}"], **look)
    best.set(ylabel="best radius (%)", ylim=(-5, 145), yticks=range(0, 101, 25))
    best.legend(ncols=4, loc="upper center", title="share of rigs in which it is best, by")
    for words, colour, marker in (("teeth", BLUE, "o"), ("ring", ORANGE, "s")):
        middle, low, high = (table[f"sliding_{words}_j_km{end}"] / 1e3 for end in ("", "_q05", "_q95"))
        work.fill_between(radii, low, high, color=colour, alpha=0.25, linewidth=0)
        work.plot(radii, middle, color=colour, label=words, marker=marker, linestyle="-")
    work.set(ylabel="sliding (kJ/km)", xlabel="radius of the ring (m)")
    work.legend()
    for ax in (free, best, work):
        ax.axvline(printed.RADIUS_CHOSEN.value, **PRINTED, linewidth=0.8)
    free.set_title(f"{table['rigs'].iloc[0]} rigs at {rpm:g} rpm; broken line: 0.308 m, the paper's choice")
    return figure
