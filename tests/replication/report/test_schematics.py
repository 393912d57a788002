"""Schematics are drawn for rigs with other wheels and another groove."""

import pytest

from trackdyn.rig.rig import load_rig
from trackdyn_replication.report.figures.schematics import FIGURES


@pytest.mark.parametrize("name", ["bench", "robot", "m113"])
def test_rigs_with_other_wheels_are_drawn(name):
    """One wheel, two on arms, six besides the sprocket, without a ring."""
    for draw in FIGURES.values():
        assert draw(load_rig(name)).axes
