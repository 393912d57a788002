"""The studies beside the replication itself, one list for configuration, rules and page.

A study has the name of its rule. A long one has two forms in ``config/studies.yaml``: its short form lies in the folder
``short`` of the results and is made by the rule ``<name>_form``, as the full one is.
"""

from typing import NamedTuple


class Study(NamedTuple):
    """A study."""

    file: str  # a file of the results that only a run of it makes
    forms: bool = True  # whether it has a short form and a full one


STUDIES = {
    "trade": Study("planner.csv"),
    "fidelity": Study("fidelity.csv", forms=False),
    "extremes": Study("extremes.csv"),
}
