"""The studies beside the replication itself, one list for configuration, rules, costs and page.

A study has the name of its rule. A long one has two forms in ``config/studies.yaml``: its short form lies in the folder
``short`` of the results and is made by the rule ``<name>_form``, as the full one is.
"""

from typing import NamedTuple


class Study(NamedTuple):
    """A study."""

    title: str  # in words
    file: str  # a file of the results that only a run of it makes
    forms: bool = True  # whether it has a short form and a full one


STUDIES = {
    "trade": Study("accuracy against cost, and the planner", "planner.csv"),
    "fidelity": Study("what each setting of the model changes", "fidelity.csv", forms=False),
    "peer_answers": Study("cost of an answer of equal error in both codes", "tables/peer_answers.csv", forms=False),
    "extremes": Study("extremes of parameters, steps and states", "extremes.csv"),
}
# rules that make nothing of a run: with the full studies they stand behind its costs
BY_NAME = (*STUDIES, "default_step", "pictures")
