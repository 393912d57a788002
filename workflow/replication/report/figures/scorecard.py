"""The scorecard of the claims as one picture."""

from trackdyn.sweeps.job import run_job

import textwrap
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from replication.paper.claims import judge_all, load_claims
from replication.paper.contents import caption
from replication.paper.evidence import collect
from replication.paper.paper_tables import load_article
from replication.paper.printed import RECORD_DURATION
from replication.paper.scorecard import MARKS, headline, side_by_side
from replication.report.tables import write_captioned_table
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.plots.style import PAGE, new_figure, save, styled

# verdict: colour, hatch (readable in grey)
LOOKS = {"shown": ("#009E73", ""), "not shown": ("#D55E00", "xx")}
LOOKS |= {"no test": ("#efefef", ""), "not comparable": ("#d9d9d9", "..")}
LINE, SIZE, HALVES = 0.15, 7, 2  # height of a row, inch; points; columns of rows
CELL, LETTERS = 0.42, 40  # width of a rig's cell, inch; letters of a claim


@styled
def scorecard_figure(card: pd.DataFrame) -> Figure:
    """The verdict on every statement (``paper.claims.judge_all``), a row a statement and a cell a rig.

    What was measured is in the table of the claims.
    """
    rigs = list(dict.fromkeys(card["rig"]))
    rows = [
        (f"{name}{letter}", of["claim"].iloc[0], dict(zip(of["rig"], of["verdict"], strict=True)))
        for (name, letter), of in card.fillna({"part": ""}).groupby(["id", "part"], sort=False)
    ]
    length = -(-len(rows) // HALVES)
    figure = new_figure(LINE * length + 1.0, PAGE)
    width = PAGE / HALVES
    ax = figure.subplots()
    ax.set(xlim=(0, PAGE), ylim=(length + 0.2, -1.6))
    ax.set_axis_off()
    for half in range(HALVES):
        left = half * width
        for k, rig in enumerate(rigs):
            ax.text(left + (k + 0.5) * CELL, -1.1, rig, ha="center", va="center", fontsize=SIZE - 1.5)
        for y, (name, claim, verdicts) in enumerate(rows[half * length : (half + 1) * length]):
            for k, rig in enumerate(rigs):
                colour, hatch = LOOKS[verdicts[rig]]
                ax.barh(y, CELL - 0.04, left=left + k * CELL, height=0.85, color=colour, hatch=hatch, edgecolor="white")
                ax.text(left + (k + 0.5) * CELL, y, MARKS[verdicts[rig]], ha="center", va="center", fontsize=SIZE)
            text = textwrap.shorten(claim, LETTERS, placeholder=" …")
            ax.text(left + len(rigs) * CELL + 0.05, y, f"{name}  {text}", va="center", fontsize=SIZE - 1.5)
    looks = [Patch(facecolor=colour, hatch=hatch, edgecolor="white") for colour, hatch in LOOKS.values()]
    figure.legend(
        looks, [f"{MARKS[name]} {name}".strip() for name in LOOKS], loc="outside lower center", ncols=len(LOOKS)
    )
    return figure


def main(job) -> None:
    """Rule `claims`."""
    of, out = job.params, job.output
    # folder of the results of each rig; further rigs stand beside the first
    folders = {of.rig: Path(job.input.metrics).parent} | dict(of.rigs)
    tables = load_article(job.input.tables[0]) if job.input.tables else None
    rigs = {name: collect(folder, of.rpm, of.radius, tables) for name, folder in folders.items()}
    card, values = judge_all(load_claims(job.input.claims), rigs)
    message = [headline(card, name) for name in rigs]
    if of.seconds < RECORD_DURATION.value:
        message.append(
            f"These records last {of.seconds:g} s where the paper's last {RECORD_DURATION.value:g}: bins are wider, so "
            "C07 and C08 cannot come out, and records hold no whole number of revolutions (C06)."
        )
    text = "\n\n".join([*message, caption("claims")])
    write_captioned_table(card, out.csv, text, shown=side_by_side(card))
    write_csv(out.values, values, float_format="%.9g")
    write_text(out.schema, schema_text(card.columns, "claims"))
    write_text(out.values_schema, schema_text(values.columns, "claims_values"))
    save(scorecard_figure(card), out.figure[0])
    print(text)


if __name__ == "__main__":
    run_job(main)
