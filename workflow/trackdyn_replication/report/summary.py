"""Answer of the replication as paragraphs, for the README and the first screen of the page."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from jinja2 import StrictUndefined, Template

from trackdyn_replication.paper.finding import finding_sentences, ran
from trackdyn_replication.paper.scorecard import missed_numbers, other_numbers, verdict_line
from trackdyn_replication.paper.tracks import RUBBER, creep_slope, mobilised, neighbours_free


def blocks(template: Path, **values) -> list[str]:
    """Render the blocks of a page from a template, in which ``----`` separates them; a paragraph is one line."""
    written = Template(template.read_text(encoding="utf-8"), undefined=StrictUndefined, trim_blocks=True)
    texts = (filter(None, map(str.strip, text.split("\n\n"))) for text in written.render(values).split("\n----\n"))
    return ["\n\n".join(line if line[0] == "|" else " ".join(line.split()) for line in block) for block in texts]


def summary(
    study: pd.DataFrame, judged: pd.DataFrame, numbers: pd.DataFrame, parameters: pd.DataFrame, near: pd.DataFrame,
    learned: Mapping[str, pd.DataFrame], **links: str,
) -> list[str]:  # fmt: skip
    """Word the answer of the replication: the finding, the verdict on the default rig, missed numbers, its ring."""
    return blocks(
        Path(__file__).with_name("summary.md.j2"),
        finding=" ".join(finding_sentences(ran(study), brief=True)),
        rig=judged["rig"].iloc[0], fitted=int((parameters["kind"] == "fitted").sum()), near=neighbours_free(near),
        verdict=verdict_line(judged, numbers), others=other_numbers(numbers), missed=missed_numbers(numbers),
        mobilised=mobilised(learned["mobilised"], creep_slope(parameters)), links=links,
        slips=creep_slope(parameters) < RUBBER[0],
    )  # fmt: skip
