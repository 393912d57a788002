"""Figures and tables of the paper and of our own, by rule, and the sections of the page (``contents.yaml``)."""

import re
from dataclasses import dataclass
from pathlib import Path

from trackdyn.inputs.yaml_file import read_yaml

WITHOUT_SENSOR = "There is no sensor record (`sensor_csv`): the simulation stands alone."


@dataclass(frozen=True)
class Item:
    """A figure or a table."""

    key: str  # ``fig01`` to ``fig24``, ``table1`` to ``table4``, or the name of one of our own
    title: str  # content in our words
    rule: str  # the rule of the workflow that makes it
    text: str  # its caption as it is written here; read it with :meth:`caption`
    if_synthetic: str = ""  # one paragraph more where the sensor's records, which it shows, are synthetic
    table: bool = False  # whether it is a table
    left_out: str = ""  # columns that the page leaves out, a regular expression
    left_out_if_synthetic: str = ""  # further ones, and rows with such a cell, where the sensor's records are synthetic

    @property
    def label(self) -> str:
        """``Figure 7``, ``Table 2``; for our own nothing."""
        numbered = re.fullmatch(r"(fig|table)(\d+)", self.key)
        return f"{'Figure' if numbered[1] == 'fig' else 'Table'} {int(numbered[2])}" if numbered else ""

    def caption(self, synthetic: bool | None) -> list[str]:
        """Return the caption's paragraphs, plain text, names of files in backquotes (`published.SENSORS`)."""
        of_sensor = {True: self.if_synthetic, False: "", None: self.if_synthetic and WITHOUT_SENSOR}[synthetic]
        texts = [*self.text.split("\n\n"), *([of_sensor] if of_sensor else [])]
        return [" ".join(text.split()) for text in texts]

    def files(self, results: Path | str) -> list[Path]:
        """Return the files that show it: one, or one per letter (``fig17_a.png``); none if it is missing."""
        results = Path(results)
        if self.table:
            return [path for path in [results / "tables" / f"{self.key}.csv"] if path.is_file()]
        folder = results / "figures"
        return sorted([*folder.glob(f"{self.key}.png"), *folder.glob(f"{self.key}_[a-h].png")])


_LIST = read_yaml(Path(__file__).with_suffix(".yaml"))
PAGE = _LIST.pop("page")
# figures and tables by group, in the order of their keys
_GROUPS = {
    group: tuple(
        Item(**{"key": key, "rule": rule, "table": key.startswith("table")} | entry)
        for key, rule, entry in sorted((key, rule, items[key]) for rule, items in rules.items() for key in items)
    )
    for group, rules in _LIST.items()
}
PAPER, OWN, OF_STUDIES = (_GROUPS[group] for group in ("paper", "own", "studies"))


def missing_items(results: Path | str) -> list[Item]:
    """Return the figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]
