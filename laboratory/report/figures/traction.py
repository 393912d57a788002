"""Which flank carries drive over the ring's traction and radius."""

import numpy as np

from trackdyn.plots.style import SMALL, new_figure, styled

TITLES = {"friction": "coefficient held", "transition_velocity": "transition velocity held"}
FULL = 45.0  # % of a turn: what an arc without a ring reaches


@styled
def traction_figure(table, own: float, wheels: float):
    """Shares of both arcs (% of a sprocket turn) over creep slope and radius.

    Parameters
    ----------
    table : DataFrame
        `study.traction.traction_scan`.
    own, wheels : float
        Creep slope of the rig's ring and of its other wheels, s/m: marked above each panel.
    """
    figure = new_figure(5.0)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for column, (hold, title) in enumerate(TITLES.items()):
        for row, side in enumerate(("left", "right")):
            chosen = table[table["hold"] == hold]
            shares = chosen.pivot(index="ring_radius_m", columns="slope_s_per_m", values=f"{side}_share_pct")
            panel, values = axes[row][column], shares.to_numpy()
            drawn = panel.pcolormesh(
                np.arange(values.shape[1]), np.arange(values.shape[0]), values, cmap="viridis", vmin=0, vmax=FULL,
                shading="nearest",
            )  # fmt: skip
            for (y, x), value in np.ndenumerate(values):
                text = "–" if np.isnan(value) else f"{value:.0f}"
                panel.text(
                    x, y, text, ha="center", va="center", fontsize=SMALL, color="white" if value <= 25 else "black"
                )
            panel.set_xticks(range(values.shape[1]), [f"{slope:g}" for slope in shares.columns], rotation=45)
            panel.set_yticks(range(values.shape[0]), [f"{1e3 * radius:g}" for radius in shares.index])
            panel.set_title(f"{side} arc,\n{title}")
            for slope, name in ((own, "this ring"), (wheels, "other wheels")):
                place = np.interp(np.log(slope), np.log(shares.columns), range(values.shape[1]))
                panel.plot(
                    place, 1.0, "v" if name == "this ring" else "D", color="black", ms=4, label=name, ls="none",
                    transform=panel.get_xaxis_transform(), clip_on=False,
                )  # fmt: skip
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    figure.supxlabel("creep slope of the ring's friction (s/m)", fontsize=8)
    figure.supylabel("ring radius (mm)", fontsize=8)
    figure.colorbar(drawn, ax=axes, label="contact (% of a sprocket turn)", shrink=0.8)
    return figure
