"""The scorecard of the claims as one picture."""

import re
import textwrap

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from replication.paper.claims import ORIGINS, headline
from trackdyn.plots.style import PAGE, new_figure, power_of_ten, styled

# verdict: colour, hatch (readable in grey)
LOOKS = {
    "reproduced": ("#009E73", ""),
    "in trend": ("#56B4E9", "//"),
    "not reproduced": ("#D55E00", "xx"),
    "no test": ("#efefef", ""),
    "not comparable": ("#d9d9d9", ".."),
}
HEADS = {
    "predicted": "Predicted: open tests", "transfer": "Transfer: fitted at one speed, judged at the others",
    "follows": "Follows from the fit or from kinematics",
    "fitted": "Fitted: targets, or a parameter was chosen by them",
    "implied": "Implied by our reading of the text", "": "Nothing to compare with",
}  # fmt: skip
LINE, GAP = 0.145, 0.09  # height of a line of text and space between two claims, inch
SIZE = 8
# columns: left edge (inch) and how many letters fit
BAR, ID, CLAIM, PRINTED, MEASURED = 0.0, 1.16, 1.64, 4.42, 5.66
CLAIM_LETTERS, PRINTED_LETTERS, MEASURED_LETTERS = 41, 18, 23


@styled
def scorecard_figure(card: pd.DataFrame) -> Figure:
    """Every claim of ``paper.claims.judge_all`` with its verdict, its printed and its measured value.

    Verdicts and values of several rigs stand below one another. ``printed`` that begins with *ours* is a bound of
    this replication; *in words* means that no number is printed.
    """
    rigs = list(dict.fromkeys(card["rig"]))
    blocks = []
    for origin in (*ORIGINS, ""):
        rows = card[card["origin"].fillna("") == origin]
        if len(rows):
            blocks += [(HEADS[origin], [])]
            parts = rows.fillna({"part": ""}).groupby(["id", "part"], sort=False)
            blocks += [_block(part.to_dict("records"), len(rigs)) for _, part in parts]
    heights = [LINE * _lines(block) + GAP for block in blocks]
    height = sum(heights) + 0.3
    figure = new_figure(height + 0.3 + 0.2 * len(rigs), PAGE)
    ax = figure.subplots()
    ax.set(xlim=(0, PAGE), ylim=(height, 0))
    ax.set_axis_off()
    for x, head in ((CLAIM, "claim"), (PRINTED, "printed, or bound"), (MEASURED, "measured here")):
        ax.text(x, 0.12, head, va="center", fontsize=SIZE, style="italic")
    y = 0.25
    for block, high in zip(blocks, heights, strict=True):
        _draw(ax, block, y, high)
        y += high
    message = [headline(card, rig) if len(rigs) == 1 else f"{rig}: {headline(card, rig)}" for rig in rigs]
    ax.set_title("\n".join("\n".join(textwrap.wrap(text, 95)) for text in message))
    return figure


def _block(items: list[dict], rigs: int) -> tuple:
    """Name, claim and printed value of a part, and verdict and measured value of every rig, wrapped."""
    first = items[0]
    cells = []
    for item in items:
        measured = (f"{item['rig']}: " if rigs > 1 else "") + _spoken(at_speeds(item))
        cells.append((item["verdict"], textwrap.wrap(measured, MEASURED_LETTERS)))
    name = first["id"] + (first["part"] or "")
    claim = textwrap.wrap(_with_unit(first), CLAIM_LETTERS)
    printed = _spoken(first["printed"]).replace("ours:", "only words; taken as:")
    return name, cells, claim, textwrap.wrap(printed, PRINTED_LETTERS)


def _lines(block: tuple) -> int:
    _, cells, *texts = block
    return max([1, *map(len, texts), sum(len(text) for _, text in cells)])


def _draw(ax: Axes, block: tuple, y: float, high: float) -> None:
    name, cells, *texts = block
    middle = y + 0.5 * high
    if not cells:
        ax.text(BAR, middle, name, va="center", fontsize=SIZE, weight="bold")
        return
    ax.axhline(y, color="0.85", linestyle="-", linewidth=0.6)
    ax.text(ID, middle, name, va="center", fontsize=SIZE, weight="bold")
    for x, lines in zip((CLAIM, PRINTED), texts, strict=True):
        ax.text(x, middle, "\n".join(lines), va="center", fontsize=SIZE, linespacing=1.15)
    share = high / sum(len(text) for _, text in cells)
    top = y
    for verdict, text in cells:
        part = share * len(text)
        at = top + 0.5 * part
        colour, hatch = LOOKS[verdict]
        look = {"color": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0}
        ax.barh(at, 1.08, left=BAR, height=part - 0.06, **look)
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.9}
        ax.text(BAR + 0.54, at, verdict, ha="center", va="center", fontsize=SIZE, bbox=box)
        ax.text(MEASURED, at, "\n".join(text), va="center", fontsize=SIZE, linespacing=1.15)
        top += part


def _with_unit(item: dict) -> str:
    """The claim, with the unit of its numbers where it does not say it, and their speeds if they are several."""
    unit, speeds = str(item.get("unit") or "1"), str(item.get("speeds") or "")
    message = unit == "1" or re.search(rf"\d {re.escape(unit)}", str(item["claim"]))
    notes = [*([] if message else [unit]), *([f"{speeds} rpm"] if "," in speeds and not item.get("by_speed") else [])]
    return str(item["claim"]) + (f" ({'; '.join(notes)})" if notes else "")


def at_speeds(item: dict) -> str:
    """The measured value; where it is one at each of several motor speeds, each with its own."""
    speeds = str(item["speeds"]).split(", ")
    if not item.get("by_speed") or len(speeds) < 2:
        return item["measured"]
    values = re.split("[;,] ", item["measured"])
    return ", ".join(f"{value} at {rpm}" for value, rpm in zip(values, speeds, strict=True)) + " rpm"


def _spoken(value) -> str:
    """A cell of the table as it is read: powers of ten, a dash for nothing."""
    text = "" if value is None or value != value else str(value)
    return re.sub(r"\d+\.?\d*e[-+]\d+", lambda found: power_of_ten(float(found[0]), 2), text) or "\N{EN DASH}"
