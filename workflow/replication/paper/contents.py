"""Contents of a complete replication: the 24 figures and 4 tables of the paper, and those of our own.

`contents.yaml` beside this file is the one list: from a rule to its figures and tables with their titles and captions.
"""

from pathlib import Path

from replication.paper.item import Item
from trackdyn.rig.yaml_file import read_yaml

# figures and tables by group, in the order of their keys
_GROUPS = {
    group: tuple(
        Item(**{"key": key, "rule": rule, "table": key.startswith("table")} | entry)
        for key, rule, entry in sorted((key, rule, items[key]) for rule, items in rules.items() for key in items)
    )
    for group, rules in read_yaml(Path(__file__).with_suffix(".yaml")).items()
}
PAPER, OWN, OF_STUDIES = (_GROUPS[group] for group in ("paper", "own", "studies"))


def missing_items(results: Path | str) -> list[Item]:
    """The figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]


def caption(key: str, synthetic: bool | None = True) -> str:
    """Caption of the figure or table ``key`` after its label, as it stands above a written table.

    ``synthetic`` says what the sensor's records are (`item.SENSORS`).
    """
    (item,) = (item for item in (*PAPER, *OWN, *OF_STUDIES) if item.key == key)
    return (f"{item.label}. " if item.label else "") + "\n\n".join(item.caption(synthetic))
