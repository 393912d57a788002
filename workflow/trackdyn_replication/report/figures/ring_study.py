"""Figures 23 and 24 with printed values, contact durations with a ring that grips, effect of its tangential force."""

from trackdyn.sweeps.snakemake_job import run_job

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.inputs.quantities import entries_of
from trackdyn.plots import style
from trackdyn.plots.ring_study import figures
from trackdyn.plots.style import COLOURS, DASHES, MARKERS, SMALL, new_figure, save, styled
from trackdyn.rig.rig_file import read_rig
from trackdyn_replication.paper import published
from trackdyn_replication.paper.finding import OWN, main_run, of_law, ran, shares, windows

MARKS = {
    "right arc free from here on (printed)": published.RADIUS_WITHOUT_RIGHT_CONTACT,
    "recommended (printed)": published.RADIUS_CHOSEN,
}
STEADY = published.STEADY_LEFT_SHARE, published.RADIUS_OF_STEADY_LEFT_SHARE
EVENTS = {
    "right_free_from_m": ("right arc lets go", style.BLUE),
    "right_back_from_m": ("right arc touches again", style.VERMILION),
    "left_lost_from_m": ("left arc touches no more", style.ORANGE),
}
AXES = {
    "transition_velocity": ("transition velocity of Eq. 10 (mm/s)", 1e3),
    "shear_stiffness": ("shear stiffness of Dahl's law (kN/m)", 1e-3),
}
VERDICTS = {"conclusion_3": "no right arc from 0.305 m on", "plateau": "left arc near 10 % from 0.307 m on"}


@styled
def creep_figure(study: pd.DataFrame, grips: pd.DataFrame) -> Figure:
    """Draw contact durations of the arcs over the radius, for the default rig's ring and one of rubber, which grips."""
    figure = new_figure(4.2)
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, (title, rows) in zip(axes.T, {"default rig": study, "a ring that grips": grips}.items(), strict=True):
        column[0].set_title(title)
        for i, (rpm, group) in enumerate(rows.dropna(subset="ring_radius_m").groupby("rpm")):
            look = {"color": COLOURS[i % 4], "linestyle": DASHES[i % 4], "marker": MARKERS[i % 4]}
            group = group.sort_values("ring_radius_m")
            for ax, side in zip(column, ("left", "right"), strict=True):
                ax.plot(1e3 * group["ring_radius_m"], group[f"{side}_share_pct"], **look, label=f"{rpm:g} rpm")
        for ax in column:
            ax.axvline(1e3 * published.RADIUS_WITHOUT_RIGHT_CONTACT, **style.PRINTED, linewidth=0.6, zorder=1)
        column[1].set_xlabel("radius of the ring (mm)")
    for ax, side in zip(axes[:, 0], ("left", "right"), strict=True):
        ax.set_ylabel(f"{side} arc (% of a turn)")
        ax.set_ylim(bottom=-0.5)  # not before: it ends the scaling to the data of the row
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


@styled
def grip_figure(table: pd.DataFrame, ranges: dict[str, tuple[float, float]]) -> Figure:
    """Draw radii at which an arc lets go over the mobilised friction, and shares of tracks over either law's value."""
    figure = new_figure(4.2, style.PAGE)
    left, right = figure.subfigures(1, 2, width_ratios=(1.15, 1.0))
    _draw_window(left.subplots(), table)
    counts = shares(table)
    for ax, law in zip(right.subplots(2, 1, sharey=True), ("dahl", "regularised"), strict=True):
        _draw_shares(ax, counts, law, ranges[OWN[law]])
    return figure


def _draw_window(ax: Axes, table: pd.DataFrame) -> None:
    """Draw where an arc lets go or comes back: each track and law a mark, bands of 10 to 90 % of them, medians."""
    run, bands = main_run(table), windows(table)
    top = 1e3 * float((run[[*EVENTS]].max(axis=1) - run["polygon_m"]).max()) + 0.5
    random = np.random.default_rng(1)
    for event, (label, colour) in EVENTS.items():
        for law, marker in zip(OWN, MARKERS, strict=False):
            rows = run[(run["law"] == law) & run[event].notna()]
            # radii are a millimetre or two apart: marks are spread over it to be told apart
            spread = random.uniform(-0.25, 0.25, len(rows))
            height = 1e3 * (rows[event] - rows["polygon_m"]) + spread
            ax.plot(rows["mobilised_friction"], height, marker, color=colour, markersize=1.6, alpha=0.35, mew=0)
        rows = bands[bands["event"] == event]
        x = np.sqrt(rows["low"] * rows["high"])
        lower, middle, upper = (np.minimum(1e3 * rows[name], top) for name in ("q10", "q50", "q90"))
        ax.fill_between(x, lower, upper, color=colour, alpha=0.18, linewidth=0)
        shown = np.isfinite(rows["q50"])
        ax.plot(x[shown], middle[shown], color=colour, label=label)
    for law, marker in zip(("Eq. 10", "Dahl's law"), MARKERS, strict=False):
        ax.plot([], [], marker, color="0.4", markersize=3, label=law)
    ax.set(xscale="log", ylim=(None, top), title="Radii at which an arc lets go or comes back")
    ax.set(xlabel="mobilised friction of the ring at 0.308 m (1)", ylabel="ring radius less polygon radius (mm)")
    ax.figure.legend(loc="outside lower center", fontsize=SMALL, ncols=2)


def _draw_shares(ax: Axes, counts: pd.DataFrame, law: str, span: tuple[float, float]) -> None:
    """Draw shares of tracks with their 90 % intervals over the value of a law; its assumed range is shaded."""
    label, factor = AXES[OWN[law]]
    speeds = counts.groupby("rpm")["tracks"].max()
    for rpm, most in speeds.items():
        rows, filled = of_law(counts, law, rpm), rpm == speeds.idxmax()  # that of the most tracks
        x = factor * rows.index.to_numpy()
        for (name, words), colour, marker in zip(VERDICTS.items(), COLOURS[1:], MARKERS, strict=False):
            share, low, high = (100 * rows[f"{name}_{end}"] for end in ("share", "low", "high"))
            look = {"color": colour, "marker": marker, "capsize": 2, "linestyle": "-" if filled else ":"}
            look |= {} if filled else {"markerfacecolor": "white"}
            text = f"{words}, {rpm:g} rpm, {most} tracks"
            ax.errorbar(x, share, (share - low, high - share), label=text, **look)
    ax.axvspan(*(factor * end for end in span), color="0.9", zorder=0)
    ax.set(xscale="log", xlabel=label, ylabel="tracks (%)", ylim=(-3, 103))
    if law == "dahl":
        ax.set_title("Share of the tracks")
        ax.figure.legend(loc="outside lower center", fontsize=SMALL)


@run_job
def main(job) -> None:
    """Rules `ring_figures` and `grip_figure`."""
    if job.rule == "grip_figure":
        entries = entries_of(read_rig(job.input.rig))
        ranges = {name: (entry["low"], entry["high"]) for name in AXES for entry in [entries[f"ring_contact.{name}"]]}
        save(grip_figure(ran(pd.read_csv(job.input.table)), ranges), job.output[0])
        return
    study = pd.read_csv(job.input.metrics)
    drawn = figures(study, MARKS, STEADY)
    if grips := job.input.get("grips"):
        drawn["creep"] = creep_figure(study, pd.read_csv(grips[0]))
    for name, figure in drawn.items():
        save(figure, job.output[name][0])
