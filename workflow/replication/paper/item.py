"""Description of a figure or a table, which needs no drawing."""

from dataclasses import dataclass
from pathlib import Path

# names of a sensor's record: synthetic, measured, or none there
SENSORS = {True: "synthetic sensor", False: "sensor", None: "no sensor record"}
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

    @property
    def label(self) -> str:
        """``Figure 7``, ``Table 2``; for our own nothing."""
        for word, name in (("fig", "Figure"), ("table", "Table")):
            number = self.key.removeprefix(word)
            if number != self.key and number.isdigit():
                return f"{name} {int(number)}"
        return ""

    def caption(self, synthetic: bool | None) -> list[str]:
        """Paragraphs of the caption, plain text, names of files and columns in backquotes; ``synthetic``: `SENSORS`."""
        of_sensor = {True: self.if_synthetic, False: "", None: self.if_synthetic and WITHOUT_SENSOR}[synthetic]
        texts = [*self.text.split("\n\n"), *([of_sensor] if of_sensor else [])]
        return [" ".join(text.split()) for text in texts]

    def files(self, results: Path | str) -> list[Path]:
        """The files that show it: one, or one a letter (``fig17_a.png``); none if it is missing."""
        results = Path(results)
        if self.table:
            return [path for path in [results / "tables" / f"{self.key}.csv"] if path.is_file()]
        folder = results / "figures"
        return sorted([*folder.glob(f"{self.key}.png"), *folder.glob(f"{self.key}_[a-h].png")])
