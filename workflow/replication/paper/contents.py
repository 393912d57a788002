"""What belongs to a complete replication: the 24 figures and 4 tables of the paper, and those of our own.

`contents.yaml` beside this file is the one list: from the number of a figure to its title, its caption and its rule.
"""

from collections.abc import Iterable
from pathlib import Path

from replication.paper.item import Item
from trackdyn.parameters.yaml_file import read_yaml


def load_items(path: Path) -> dict[str, tuple[Item, ...]]:
    """Figures and tables of a list (YAML), by its groups."""
    groups = read_yaml(path)
    return {group: tuple(Item(key, **entry) for key, entry in items.items()) for group, items in groups.items()}


_GROUPS = load_items(Path(__file__).with_suffix(".yaml"))
PAPER, OWN, OF_STUDIES = (_GROUPS[group] for group in ("paper", "own", "studies"))


def missing_items(results: Path | str) -> list[Item]:
    """The figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]


def caption(key: str, synthetic: bool | None = True, items: Iterable[Item] = (*PAPER, *OWN, *OF_STUDIES)) -> str:
    """Caption of a figure or table after its label: what stands above a written table."""
    (item,) = (item for item in items if item.key == key)
    return (f"{item.label}. " if item.label else "") + "\n\n".join(item.caption(synthetic))
