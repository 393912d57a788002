"""Results of the searches for rigs: a table, and cost against rows."""

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
from trackdyn.sweeps.design import write_table

ACROSS = 3  # panels beside each other


def answer_text(ends: pd.DataFrame, verdicts: pd.DataFrame, near: pd.DataFrame, profiles: pd.DataFrame) -> str:
    """The best end of each question with the statements that it does not show, its neighbours, and profiles."""
    texts = {claim.name: claim.claim for claim in load_claims("config/claims.yaml")}
    paragraphs = []
    for question, rows in verdicts.groupby("question", sort=False):
        searches = ends[ends["question"] == question]
        best = searches.iloc[0]
        missed = rows[rows["verdict"] != SHOWN]
        paragraphs.append(
            f"The rig `{question}` shows {len(rows) - len(missed)} of the {len(rows)} statements that a search judges "
            f"({best['evaluations']:g} rows of {best['method']}; searches: {len(searches)}). Not shown, with the "
            "distance in tolerances:"
        )
        lines = zip(missed["claim"], missed["distance"], strict=True)
        paragraphs.append("\n".join(f"- {texts[name]} ({off:.1f})" for name, off in lines))
    for row in near.itertuples():
        paragraphs.append(
            f"All free values of `{row.question}` were moved at random by up to {100 * row.share_moved:g} %. Of "
            f"{row.rigs} such rigs 90 % show at least {row.shown_by_90_pct} of {row.of} statements; the median is "
            f"{row.median:g}, the least {row.least:g}."
        )
    table = profiles[["assumption", "value", "evaluations", "shown", "of"]].convert_dtypes().astype(object).fillna("")
    paragraphs.append(
        "One assumption of the rig `paper` changed at a time, all other unknowns searched again in so many evaluations "
        "(1: none):\n\n" + table.to_markdown(index=False, disable_numparse=True)
    )
    return "\n\n".join(paragraphs) + "\n"


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
