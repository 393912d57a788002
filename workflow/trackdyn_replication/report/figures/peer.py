"""Figures 13 and 14: the independent code's model, and the selected link's vertical displacement in both codes."""

from trackdyn.sweeps.snakemake_job import run_job

import json
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from trackdyn.inputs.files import write_csv
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, ORANGE, VERMILION, new_figure, save, styled, thin, upper_edge
from trackdyn.rig.rig import Rig, load_rig
from trackdyn_replication.paper import published
from trackdyn_replication.report import marks

LEAST_DIFFERENCE = 1e-6  # lower end of the logarithmic axis, percent
OURS = {"color": BLUE, "linestyle": "-", "linewidth": 2.2, "alpha": 0.6}
PEER = {"color": ORANGE, "linestyle": (0, (5, 2)), "linewidth": 1.2}


@styled
def model_figure(rig: Rig, frame, shift: float, missing: str = "") -> Figure:
    """Draw the loop of the independent code (a), or ours if that is ``missing``, and its tooth profile (b)."""
    figure = new_figure(5.6)
    complete, tooth = figure.subplots(2, 1, height_ratios=(1.25, 1.0))
    body = 2 * (rig.first_sensor.pitch - 1)
    drawing.draw_loop(complete, rig, frame, shift, rig.sprocket.ring_radius, highlight=(body,))
    complete.set_aspect("equal")
    complete.margins(0.03)
    complete.autoscale_view()
    code = "Exudyn's" if not missing else "trackdyn's (exudyn is not installed)"
    bodies = f"{2 * rig.chain.pitches} bodies, {2 * rig.chain.pitches} revolute joints"
    title = f"(a) {code} loop on its wheels: {bodies};\nhatched: the selected link"
    complete.set(xlabel="x (m)", ylabel="y (m)", title=title)

    groove, half = rig.groove_profile, 0.5 * rig.connector_length
    look = {"color": BLUE, "linewidth": 3.0, "alpha": 0.6, "linestyle": "-"}
    tooth.plot(*groove.profile().T, **look, label="trackdyn and Exudyn: ten arcs")
    tooth.plot(*groove.joints().T, linestyle="none", marker="o", markersize=4, color=VERMILION, zorder=drawing.Z_MARK)
    height = (rig.pin_circle**2 - half**2) ** 0.5
    look = {"fill": False, "linewidth": 0.8, "linestyle": (0, (4, 2)), "label": "connector on the pin circle"}
    tooth.add_patch(drawing.connector_patch(rig, [(-half, height), (half, height)], **look))
    tooth.margins(0.04, 0.1)
    marks.frame_axes(tooth)
    tooth.set_title("(b) one groove, in its own frame; dots: where its arcs meet")
    figure.legend(loc="outside lower center", ncols=1)
    return figure


@styled
def displacement_figure(curves: pd.DataFrame, summary: pd.DataFrame, missing: str = "") -> Figure:
    """Draw the vertical displacement of the selected link in both codes, and their difference."""
    count = len(summary)
    figure = new_figure(2.6 * count + 0.7)
    axes = figure.subplots(2 * count, 1, height_ratios=(1.5, 1.0) * count, squeeze=False)[:, 0]
    for i, row in enumerate(summary.to_dict("records")):
        above, below = axes[2 * i : 2 * i + 2]
        curve = curves[curves["reading"] == row["reading"]]
        time, ours = curve["time_s"].to_numpy(), curve["trackdyn_m"].to_numpy()
        above.plot(*thin(time, ours), **OURS, label="trackdyn")
        title = f"({'ab'[i]}) {row['reading']} at {row['speed_rpm']:g} rev/min"
        above.set(ylabel="y of the link (m)", xlim=(time[0], time[-1]), title=title)
        above.tick_params(labelbottom=False)
        below.sharex(above)
        below.set_ylabel("difference\n(% of range)")
        if missing:
            box = {"facecolor": "white", "edgecolor": BLACK, "linewidth": 0.6}
            below.text(0.5, 0.5, missing, transform=below.transAxes, ha="center", va="center", fontsize=8, bbox=box)
            below.set_yticks([])
            continue
        other, limit = curve["exudyn_m"].to_numpy(), published.DISPLACEMENT_DIFFERENCE
        above.plot(*thin(time, other), **PEER, label="Exudyn")
        difference = np.maximum(100 * np.abs(other - ours) / np.ptp(ours), LEAST_DIFFERENCE)
        edges, largest = upper_edge(difference, 300)  # it keeps crossing zero
        below.plot(time[edges[:-1]], largest, **PEER)
        below.axhline(limit, color=BLACK, linestyle=(0, (6, 2)), linewidth=1.0, label=f"printed, largest: {limit:g} %")
        below.set(yscale="log", ylim=(None, 50), title=f"largest difference: {row['difference_pct']:.2g} %")
    axes[-1].set_xlabel("time since the start of the sprocket (s)")
    handles = [handle for ax in axes[:2] for handle in ax.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    figure.align_ylabels()
    return figure


@run_job
def main(job) -> None:
    """Rule `peer`."""
    inputs, out = job.input, job.output
    curves, summary, costs = map(pd.read_csv, (inputs.curves, inputs.summary, inputs.costs))
    model = json.loads(Path(inputs.model).read_text(encoding="utf-8"))
    write_csv(out.table, costs)
    frame = np.array(model["frame"])
    save(model_figure(load_rig(inputs.rig), frame, model["shift"], model["missing"]), out.figure13[0])
    save(displacement_figure(curves, summary, model["missing"]), out.figure14[0])
