"""Minimal conflicting sets of an invented model of which it is known what goes together."""

import numpy as np
import pandas as pd
import pytest

from laboratory.inference.ensemble.conflicts import CONFLICT, FOUND, LARGER, SHOWN, minimal_conflicts
from laboratory.inference.ensemble.settings import ConflictSearch
from laboratory.inference.search import bent

FAR = [0.2, 0.7, 0.5, 0.9]
CALLS: list[tuple] = []


def rows(memory):
    def compute(x, y):
        CALLS.append((x, y))
        return {"x": x, "y": y}

    return compute


class Square:
    """A asks for x = 0.2, B for y = 0.7, C for x + y = 0.5, D for x = 0.9; the tolerance is 0.1.

    A and D exclude each other, and C goes with neither B nor D: x or y would be negative.
    """

    rows, sources = staticmethod(rows), "invented"

    def __init__(self, claims, asks):
        self.claims, self.asks = claims, asks

    def task(self, x):
        return {"x": float(x[0]), "y": float(x[1])}

    def residuals(self, values):
        return bent(np.array([off(self.asks, values["x"], values["y"])[claim] for claim in self.claims]))


def off(asks, x, y):
    """Residuals of all claims, in tolerances."""
    return dict(zip("ABCD", (np.array([x, y, x + y, x]) - asks) / 0.1, strict=True))


def searched(rigs, asks=FAR, claims="ABCD", sets=100, starts=2, store=None):
    """Minimal conflicts from rigs that ran."""
    worst = pd.DataFrame([{c: abs(off(asks, *rig)[c]) for c in claims} for rig in rigs])
    settings = ConflictSearch(size=3, sets=sets, starts=starts, evaluations=60)
    asked = lambda chosen: {"claims": list(chosen), "asks": asks}  # noqa: E731
    how = {"method": "trf", "radius": 0.1, "directions": None}
    CALLS.clear()
    table, found = minimal_conflicts(
        Square, asked, worst, pd.DataFrame(rigs), [True, True], settings, 1.0, store=store, **how
    )
    return table.set_index("claims"), found


RIGS = [[0.1, 0.1], [0.8, 0.8], [0.2, 0.72]]


def test_every_minimal_conflict_is_found_and_no_other():
    table, found = searched(RIGS)
    assert set(table.index[table["verdict"] == CONFLICT]) == {"A D", "B C", "C D"}
    # 3.5 at the least, at x = 0.55; the sum of bent squares is flat there. The nearest rig is 6 off.
    assert 3.5 <= table.loc["A D", "search"] < 4.2 < table.loc["A D", "sample"]
    assert "A B C" not in table.index  # holds B C
    assert (table.loc[["A", "B", "A B"], "verdict"] == SHOWN).all()
    assert (table.loc[["C", "A C", "B D"], "verdict"] == FOUND).all()
    for claims in ("C", "A C", "B D"):  # the rig that is named shows it
        x, y = found[table.loc[claims, "search_rig"]]
        assert max(abs(off(FAR, x, y)[claim]) for claim in claims.split()) <= 1


def test_a_triple_may_conflict_though_its_pairs_do_not():
    table, _ = searched(RIGS, asks=[0.2, 0.2, 0.9, 0.0], claims="ABC")
    assert table.index[table["verdict"] == CONFLICT].tolist() == ["A B C"]
    assert table.loc["A B C", "search"] == pytest.approx(5 / 3, abs=0.2)


def test_a_set_that_holds_a_conflict_is_none_of_its_own():
    """C asks for what no point gives: its pairs are not searched."""
    table, _ = searched(RIGS, asks=[0.2, 0.7, 3.0, 0.9], claims="ABC")
    assert table.loc["C", "verdict"] == CONFLICT
    assert (table.loc[["A C", "B C"], "verdict"] == LARGER).all()
    assert table.loc[["A C", "B C"], "search"].isna().all() and "A B C" not in table.index
