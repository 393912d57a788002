"""What the searches for rigs found: a table, and cost against rows."""

from trackdyn.sweeps.job import run_job

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from laboratory.inference.answer.settings import load_answer
from laboratory.inference.answer.study import answer
from replication.paper.claims import SHOWN, load_claims
from trackdyn.plots.style import COLOURS, DASHES, PAGE, SMALL, new_figure, save, styled
from trackdyn.sweeps.table import write_table

HEAD = ("question", "rig", "method", "seed", "evaluations", "ended", "first_cost", "cost", "first_shown", "shown", "of")
ACROSS = 3  # panels beside each other


def answer_text(ends: pd.DataFrame, verdicts: pd.DataFrame, near: pd.DataFrame, profiles: pd.DataFrame) -> str:
    """Where every search ended, what the best rig of each question and its neighbours do not show, and profiles."""
    parts = [ends[list(HEAD)].round({"first_cost": 1, "cost": 1}).to_markdown(index=False, disable_numparse=True)]
    for question, rows in verdicts.groupby("question", sort=False):
        missed = rows[rows["verdict"] != SHOWN]
        words = ", ".join(f"{name} ({off:.3g})" for name, off in zip(missed["claim"], missed["distance"], strict=True))
        shown = len(rows) - len(missed)
        best = f"The best rig of *{question}* shows {shown} of {len(rows)}."
        parts.append(f"{best} Not shown, with the distance in tolerances: {words or 'none'}.")
    for row in near.itertuples():
        moved = f"Of {row.rigs} rigs around it, with every free value moved by up to {100 * row.share_moved:g} %,"
        as_many = f"{100 * row.share_at_least:.0f} % show as many or more, 90 % show {row.shown_by_90_pct} or more"
        least = f"median {row.median:g}, least {row.least:g}"
        parts.append(
            f"*{row.question}*, from {row.rig}, at all speeds: {row.shown} of {row.of}. {moved} {as_many}; {least}."
        )
    held = profiles[["assumption", "value", "ended", "cost", "shown", "of", "lost"]]
    table = held.round({"cost": 1}).convert_dtypes().astype(object).fillna("")
    parts.append(
        "One assumption of the rig `paper` changed at a time, nothing searched again:\n\n"
        + table.to_markdown(index=False, disable_numparse=True)
    )
    return "\n\n".join(parts) + "\n"


@styled
def search_figure(costs: pd.DataFrame) -> Figure:
    """Least cost (half the sum of squares) so far against rows, a line a search and a panel a question."""
    questions = list(dict.fromkeys(costs["question"]))
    lines = -(-len(questions) // ACROSS)
    figure = new_figure(2.3 * lines, PAGE)
    panels = figure.subplots(lines, min(ACROSS, len(questions)), squeeze=False).ravel()
    for ax in panels[len(questions) :]:
        ax.set_axis_off()
    for ax, question in zip(panels, questions, strict=False):
        searches = costs[costs["question"] == question].groupby(["rig", "method", "seed"], sort=False)
        for (dashes, colour), ((rig, method, seed), rows) in zip(product(DASHES, COLOURS), searches, strict=False):
            least, label = np.minimum.accumulate(rows["cost"]), f"{Path(rig).name}, {method} {seed}"
            ax.step(rows["row"], least, where="post", linestyle=dashes, color=colour, label=label)
        ax.set(title=question, xlabel="rows", ylim=(0, None))
        ax.legend(fontsize=SMALL).set_in_layout(False)
    for ax in panels[::ACROSS]:
        ax.set_ylabel("least cost")
    return figure


def main(job) -> None:
    """Rule `answer_table`."""
    config, claims = load_answer(job.input.config), load_claims(job.input.claims)
    config = config.shortened() if job.params.short else config
    results = [answer(config, claims, name, job.threads, job.params.store) for name in config.questions]
    tables = [pd.concat(parts, ignore_index=True) for parts in zip(*results, strict=True)]
    for name, table in zip(("ends", "costs", "verdicts"), tables, strict=True):
        write_table(table, job.output[name])
    save(search_figure(tables[1]), job.output.figures[0])


if __name__ == "__main__":
    run_job(main)
