"""The scorecard of the claims as one picture."""

import textwrap

import pandas as pd
from matplotlib.figure import Figure

from trackdyn.report.style import new_figure, styled

# verdict: colour, hatch (readable in grey)
LOOKS = {
    "reproduced": ("#009E73", ""),
    "in trend": ("#56B4E9", "//"),
    "not reproduced": ("#D55E00", "xx"),
    "not comparable": ("#d9d9d9", ".."),
}


@styled
def scorecard_figure(card: pd.DataFrame) -> Figure:
    """Every claim with its verdict, its printed and its measured value.

    Parameters
    ----------
    card : DataFrame
        ``id, claim, printed, measured, unit, verdict`` (``report.claims.judge_all``).
    """
    row = 0.34
    figure = new_figure(row * len(card) + 0.9)
    ax = figure.subplots()
    for i, item in enumerate(card.to_dict("records")):
        colour, hatch = LOOKS[item["verdict"]]
        ax.barh(i, 0.16, left=0.0, height=0.8, color=colour, hatch=hatch, edgecolor="white", linewidth=0)
        ax.text(0.08, i, item["verdict"], ha="center", va="center", fontsize=6.5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85})  # fmt: skip
        ax.text(0.17, i, item["id"], va="center", fontsize=7, weight="bold")
        ax.text(0.215, i, "\n".join(textwrap.wrap(str(item["claim"]), 62)[:2]), va="center", fontsize=6)
        values = f"printed {item['printed'] or '–'}\nmeasured {item['measured'] or '–'}"
        ax.text(0.70, i, "\n".join(line[:66] for line in values.split("\n")), va="center", fontsize=6)
    ax.set_xlim(0, 1)
    ax.set_ylim(len(card) - 0.4, -0.6)
    ax.set_axis_off()
    counts = card["verdict"].value_counts()
    ax.set_title(", ".join(f"{counts.get(verdict, 0)} {verdict}" for verdict in LOOKS))
    return figure
