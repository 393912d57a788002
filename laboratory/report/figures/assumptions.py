"""The map from assumptions to claims as one picture."""

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from laboratory.report.assumptions import NO_SYMBOL, SYMBOLS, column_name, matrix
from trackdyn.plots.style import PAGE, SMALL, new_figure, styled

MOST = 4.0  # tolerances: what is further off has the last colour
ROW, HEAD = 0.19, 1.9  # height of a claim and of the head, inch
BLANK = "#e4e4e4"


@styled
def assumptions_figure(rows: pd.DataFrame) -> Figure:
    """Every claim under every assumption: a symbol for the verdict, and the distance as colour, a strip a motor speed.

    What is judged over all speeds together has one colour.

    Parameters
    ----------
    rows : DataFrame
        Rows of `inference.assumptions.judge_assumption` of all assumptions, the base first.
    """
    verdict = matrix(rows, "verdict")
    at_speeds = rows.dropna(subset="rpm")
    speeds = sorted(at_speeds["rpm"].unique())
    norm = TwoSlopeNorm(vmin=0.0, vcenter=1.0, vmax=MOST)
    colours = colormaps["PuOr_r"]
    figure = new_figure(ROW * len(verdict) + HEAD + 0.6, PAGE)
    ax = figure.subplots()
    ax.grid(False)
    places = {claim: y for y, claim in enumerate(verdict.index)}
    columns = {name: x for x, name in enumerate(verdict.columns)}
    split = set(at_speeds["claim"])
    for row in rows[rows["rpm"].notna() | ~rows["claim"].isin(split)].itertuples():
        strips = len(speeds) if row.claim in split else 1
        place = speeds.index(row.rpm) if row.claim in split else 0
        x = columns[column_name(row.group, row.assumption)] - 0.46 + 0.92 * place / strips
        colour = BLANK if np.isnan(row.distance) else colours(norm(min(row.distance, MOST)))
        corner = (x, places[row.claim] - 0.43)
        ax.add_patch(Rectangle(corner, 0.92 / strips, 0.86, facecolor=colour, edgecolor="none"))
    for claim, y in places.items():
        for name, x in columns.items():
            word = verdict.loc[claim, name]
            symbol = SYMBOLS.get(word, NO_SYMBOL)
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.75}
            ax.text(x, y, symbol, ha="center", va="center", fontsize=SMALL, bbox=box)
    ax.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(places) - 0.5, -0.5))
    ax.set_xticks(range(len(columns)), list(columns), rotation=60, ha="left")
    ax.xaxis.tick_top()
    ax.tick_params(length=0)
    ax.set_yticks(range(len(places)), list(places))
    said = ", ".join(f"{symbol} {word}" for word, symbol in SYMBOLS.items())
    listed = ", ".join(f"{rpm:g}" for rpm in speeds)
    ax.set_xlabel(f"{said}\nstrips of a cell: {listed} rpm; grey: no distance")
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=ax, shrink=0.5, aspect=30, extend="max")
    bar.set_label("distance in tolerances; at most 1 is reproduced")
    return figure
