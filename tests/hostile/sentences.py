"""Odd values for the tests of refusals."""

from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
RIG = ROOT / "trackdyn" / "rigs" / "paper.yaml"
HUGE, LONGER = 10**400, 10**5000  # beyond a float; beyond what Python writes as text
NUMBER = "must be a finite number"
BELT = {"chain": "belt", "ring_radius": None, "contact_log": False}


NO_NUMBERS = (
    HUGE, LONGER, "115", None, [115], {}, True, 1 + 2j, float("nan"), float("inf"), np.array([1.0, 2.0]), b"1",
)  # fmt: skip
