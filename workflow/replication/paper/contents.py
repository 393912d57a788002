"""What belongs to a complete replication: the 24 figures and 4 tables of the paper, and those of our own.

`contents.yaml` beside this file is the one list: from the number of a figure to its title, its caption, the rule that
makes it and the function that draws it.
"""

from pathlib import Path

import yaml

from replication.paper.item import Item

_LISTED = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))
PAPER, OWN, STUDIES = (
    tuple(Item(key, **entry) for key, entry in _LISTED[group].items()) for group in ("paper", "own", "studies")
)


def missing(results: Path | str) -> list[Item]:
    """The figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]


def caption(key: str, synthetic: bool = True) -> str:
    """Caption of a figure or table after its label: what stands above a written table."""
    (item,) = (item for item in (*PAPER, *OWN, *STUDIES) if item.key == key)
    return (f"{item.label}. " if item.label else "") + "\n\n".join(item.caption(synthetic))
