"""Figures 23 and 24 of the replication with printed values, and contact durations with a ring that grips."""

from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd
from matplotlib.figure import Figure

from trackdyn.plots.ring_study import figures
from trackdyn.plots.style import COLOURS, DASHES, MARKERS, PRINTED, new_figure, save, styled
from trackdyn_replication.paper import published

MARKS = {
    "right arc free from here on (printed)": published.RADIUS_WITHOUT_RIGHT_CONTACT,
    "recommended (printed)": published.RADIUS_CHOSEN,
}
STEADY = published.STEADY_LEFT_SHARE, published.RADIUS_OF_STEADY_LEFT_SHARE


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
            ax.axvline(1e3 * published.RADIUS_WITHOUT_RIGHT_CONTACT, **PRINTED, linewidth=0.6, zorder=1)
        column[1].set_xlabel("radius of the ring (mm)")
    for ax, side in zip(axes[:, 0], ("left", "right"), strict=True):
        ax.set_ylabel(f"{side} arc (% of a turn)")
        ax.set_ylim(bottom=-0.5)  # not before: it ends the scaling to the data of the row
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


@run_job
def main(job) -> None:
    """Rule `ring_figures`."""
    study = pd.read_csv(job.input.metrics)
    drawn = figures(study, MARKS, STEADY)
    if grips := job.input.get("grips"):
        drawn["creep"] = creep_figure(study, pd.read_csv(grips[0]))
    for name, figure in drawn.items():
        save(figure, job.output[name][0])
