"""A pipeline that was killed goes on by the same command and ends in the same bytes (`killing.py` has the long
form).
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import killing


@pytest.fixture(scope="module")
def copies(tmp_path_factory):
    """Results of a run that nobody disturbed, and a copy of the project."""
    folder = tmp_path_factory.mktemp("killed")
    whole = killing.Copy(folder / "whole")
    files = {"measured/ring.csv", "figures/fig24.png", "figures/fig24.svg", "runs/ring/210rpm_0.308.npz"}
    assert files <= whole.complete().keys()
    return whole, killing.Copy(folder / "killed")


def test_a_killed_run_goes_on_and_ends_in_the_same_bytes(copies):
    whole, copy = copies
    done = killing.disturb(copy, rounds=4, longest=8.0, seed=3)
    results, expected = copy.complete(), whole.results()
    assert sorted(name for name in expected.keys() | results.keys() if expected.get(name) != results.get(name)) == [], (
        done
    )
    assert killing.differences(copy, whole) == []
    table = copy.folder / "measured" / "ring.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("1", "2", 1), encoding="utf-8")
    (copy.folder / "figures" / "fig24.svg").unlink()
    assert [line.split()[1] for line in killing.differences(copy, whole)] == ["figures/fig24.svg", "measured/ring.csv"]
