"""What belongs to a complete replication: the 24 figures and 4 tables of the paper, and a few of our own."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Item:
    """A figure or a table.

    Attributes
    ----------
    key : str
        ``fig01`` to ``fig24``, ``table1`` to ``table4``, or the name of one of our own.
    title : str
        What it shows, in our words.
    rule : str
        The rule of the workflow that makes it.
    """

    key: str
    title: str
    rule: str

    @property
    def is_table(self) -> bool:
        return self.key.startswith("table")

    @property
    def label(self) -> str:
        """``Figure 7``, ``Table 2``; for our own nothing."""
        for word, name in (("fig", "Figure"), ("table", "Table")):
            number = self.key.removeprefix(word)
            if number != self.key and number.isdigit():
                return f"{name} {int(number)}"
        return ""

    def files(self, results: Path | str) -> list[Path]:
        """The files that show it: one, or one a letter (``fig17_a.png``); none if it is missing."""
        results = Path(results)
        if self.is_table:
            return [path for path in [results / "tables" / f"{self.key}.csv"] if path.is_file()]
        folder = results / "figures"
        return sorted([*folder.glob(f"{self.key}.png"), *folder.glob(f"{self.key}_[a-h].png")])


PAPER = (
    Item("fig01", "The platform and its model", "schematics"),
    Item("fig02", "A piece of the double-pin chain", "schematics"),
    Item("fig03", "Topology of the closed loop", "schematics"),
    Item("fig04", "Where the chain is touched", "schematics"),
    Item("fig05", "Sections of connector and groove", "schematics"),
    Item("fig06", "Connector and groove in engagement", "schematics"),
    Item("fig07", "Path of the arc's centre and the ten annular sectors", "schematics"),
    Item("fig08", "How the sector of a point is found", "schematics"),
    Item("fig09", "Contact with a convex arc", "schematics"),
    Item("fig10", "Contact with a concave arc", "schematics"),
    Item("fig11", "Flow of the contact search", "schematics"),
    Item("fig12", "Cases of a link on a ring", "schematics"),
    Item("fig13", "The model in an independent code and its tooth profile", "peer"),
    Item("fig14", "Vertical displacement beside the independent code", "peer"),
    Item("fig15", "Gap of the closed loop", "closure"),
    Item("fig16", "The test set-up", "schematics"),
    Item("fig17", "Time histories over two revolutions", "sensor_figures"),
    Item("fig18", "Amplitude spectra", "sensor_figures"),
    Item("fig19", "Forces and areas without a ring", "meshing_figures"),
    Item("fig20", "One passage without a ring, drawn", "meshing_figures"),
    Item("fig21", "Forces and areas with the ring", "meshing_figures"),
    Item("fig22", "One passage with the ring, drawn", "meshing_figures"),
    Item("fig23", "Contact forces against ring radius and speed", "ring_figures"),
    Item("fig24", "Time in contact against ring radius and speed", "ring_figures"),
    Item("table1", "The ten arcs of a groove", "parameters"),
    Item("table2", "Computing times", "peer"),
    Item("table3", "RMS and standard deviation", "statistics"),
    Item("table4", "A coarser tooth contact", "coarse_table"),
)
OWN = (
    Item("loop", "The loop on its wheels", "loop_figure"),
    Item("claims", "The scorecard as a picture", "claims"),
    Item("sensitivity", "What moves when a fitted parameter moves", "sensitivity"),
)


def missing(results: Path | str) -> list[Item]:
    """The figures and tables of the paper that a results folder lacks, in the paper's order."""
    return [item for item in PAPER if not item.files(results)]
