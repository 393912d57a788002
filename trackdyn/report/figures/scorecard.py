"""The scorecard of the claims as one picture."""

import re
import textwrap

import pandas as pd
from matplotlib.figure import Figure

from trackdyn.report.style import WIDTH, new_figure, power_of_ten, styled

# verdict: colour, hatch (readable in grey)
LOOKS = {
    "reproduced": ("#009E73", ""),
    "in trend": ("#56B4E9", "//"),
    "not reproduced": ("#D55E00", "xx"),
    "not comparable": ("#d9d9d9", ".."),
}
LINE, GAP = 0.145, 0.09  # height of a line of text and space between two claims, inch
SIZE = 8
# columns: left edge (inch) and how many letters fit
BAR, ID, CLAIM, PRINTED, MEASURED = 0.0, 1.16, 1.52, 4.42, 5.86
CLAIM_LETTERS, VALUE_LETTERS = 41, 20


@styled
def scorecard_figure(card: pd.DataFrame) -> Figure:
    """Every claim with its verdict, its printed and its measured value.

    Parameters
    ----------
    card : DataFrame
        ``id, claim, printed, measured, unit, verdict`` (``report.claims.judge_all``). ``printed`` that
        begins with *bound* is a bound of this replication; *in words* means that no number is printed.
    """
    rows = [
        (
            item,
            textwrap.wrap(_with_unit(item), CLAIM_LETTERS),
            textwrap.wrap(_spoken(item["printed"]), VALUE_LETTERS),
            textwrap.wrap(_spoken(item["measured"]), VALUE_LETTERS),
        )
        for item in card.to_dict("records")
    ]
    heights = [LINE * max(len(part) for part in parts) + GAP for _, *parts in rows]
    height = sum(heights) + 0.3
    figure = new_figure(height + 0.4)
    ax = figure.subplots()
    ax.set_xlim(0, WIDTH)
    ax.set_ylim(height, 0)
    ax.set_axis_off()
    for x, head in ((CLAIM, "claim"), (PRINTED, "printed"), (MEASURED, "measured here")):
        ax.text(x, 0.12, head, va="center", fontsize=SIZE, style="italic")
    y = 0.25
    for (item, claim, printed, measured), high in zip(rows, heights, strict=True):
        middle = y + 0.5 * high
        colour, hatch = LOOKS[item["verdict"]]
        ax.axhline(y, color="0.85", linestyle="-", linewidth=0.6)
        ax.barh(middle, 1.08, left=BAR, height=high - 0.06, color=colour, hatch=hatch, edgecolor="white", linewidth=0)
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.9}
        ax.text(BAR + 0.54, middle, item["verdict"], ha="center", va="center", fontsize=SIZE, bbox=box)
        ax.text(ID, middle, item["id"], va="center", fontsize=SIZE, weight="bold")
        for x, lines in ((CLAIM, claim), (PRINTED, printed), (MEASURED, measured)):
            ax.text(x, middle, "\n".join(lines), va="center", fontsize=SIZE, linespacing=1.15)
        y += high
    counts = card["verdict"].value_counts()
    title = ", ".join(f"{counts.get(verdict, 0)} {verdict}" for verdict in LOOKS)
    if card["printed"].astype(str).str.startswith("bound").any():
        title += "\nbound: ours, read into the paper's words"
    ax.set_title(title)
    return figure


def _with_unit(item: dict) -> str:
    """The claim, with the unit of its numbers where it does not say it itself."""
    unit = str(item.get("unit") or "1")
    said = unit == "1" or re.search(rf"\d {re.escape(unit)}", str(item["claim"]))
    return str(item["claim"]) + ("" if said else f" ({unit})")


def _spoken(value) -> str:
    """A cell of the table as it is read: powers of ten, a dash for nothing."""
    text = "" if value is None or value != value else str(value)
    return re.sub(r"\d+\.?\d*e[-+]\d+", lambda found: power_of_ten(float(found[0]), 2), text) or "\N{EN DASH}"
