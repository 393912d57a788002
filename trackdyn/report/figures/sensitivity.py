"""What moves when a fitted parameter moves."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from trackdyn.report.style import new_figure, styled

# changes beyond this many tolerances share the last shade
LIMIT = 3.0


@styled
def sensitivity_figure(table: pd.DataFrame) -> Figure:
    """Change of each measure, in tolerances of its target, for one changed parameter at a time.

    Parameters
    ----------
    table : DataFrame
        ``fit.sensitivity``.
    """
    where = table["ring_radius_m"].map(lambda r: "no ring" if pd.isna(r) else f"{r:.3f} m")
    names = table["claim"] + " " + table["measure"].str.replace("_", " ") + ", " + where
    table = table.assign(name=names)
    grid = table.drop_duplicates(["parameter", "name"]).pivot(
        index="name", columns="parameter", values="change_in_tolerances"
    )
    grid = grid.loc[list(dict.fromkeys(table["name"])), list(dict.fromkeys(table["parameter"]))]
    figure = new_figure(0.32 * len(grid) + 1.9)
    ax = figure.subplots()
    image = ax.imshow(grid.to_numpy(dtype=float), cmap="PuOr", vmin=-LIMIT, vmax=LIMIT, aspect="auto")
    for i, j in np.ndindex(grid.shape):
        value = grid.iloc[i, j]
        text = "–" if not np.isfinite(value) else f"{value:+.1f}"
        dark = np.isfinite(value) and abs(value) > 0.75 * LIMIT
        ax.text(j, i, text, ha="center", va="center", fontsize=7, color="white" if dark else "black")
    ax.set_xticks(
        range(grid.shape[1]),
        [c.replace(".", "\n") for c in grid.columns],
        fontsize=6,
        rotation=45,
        ha="right",
    )
    ax.set_yticks(range(grid.shape[0]), grid.index, fontsize=7)
    ax.grid(False)
    ax.set_title("Change of a measure in tolerances of its target, one parameter changed")
    figure.colorbar(image, ax=ax, label="tolerances", shrink=0.8)
    return figure
