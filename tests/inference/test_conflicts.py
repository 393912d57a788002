"""Minimal conflicting sets of an invented model of which it is known what goes together."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.inference.conflicts import approach, minimal_conflicts
from trackdyn.inference.search import Round, Start, bent


def rows(memory):
    return lambda x, y: {"x": x, "y": y}


class Square:
    """A asks for x = 0.2, B for y = 0.7, C for x + y = 0.5, D for x = 0.9; the tolerance is 0.1.

    A and D exclude each other, and C goes with neither B nor D: x or y would be negative.
    """

    rows, sources = staticmethod(rows), "invented"
    groups = ("A", "B", "C", "D")

    def task(self, x):
        return {"x": float(x[0]), "y": float(x[1])}

    def residuals(self, values):
        x, y = values["x"], values["y"]
        return bent(np.array([x - 0.2, y - 0.7, x + y - 0.5, x - 0.9]) / 0.1)


def square():
    return Square()


STARTS = [Start("low", [0.1, 0.1], [True, True]), Start("high", [0.8, 0.8], [True, True])]
ROUNDS = [Round(evaluations=60)]


def test_every_minimal_conflict_is_found_and_no_other():
    table = minimal_conflicts(square, {}, ["A", "B", "C", "D"], STARTS, ROUNDS, method="trf").set_index("claims")
    assert set(table.index[table["conflict"]]) == {"A D", "B C", "C D"}
    assert table.loc["A D", "approach"] == pytest.approx(3.5, abs=0.3)
    assert table.loc["A B", "approach"] < 0.05
    assert "A B C" not in table.index  # holds B C
    assert not table.loc[["A", "B", "C", "D", "A B", "A C", "B D"], "conflict"].any()


def test_a_triple_may_conflict_though_its_pairs_do_not(monkeypatch):
    monkeypatch.setattr(
        Square,
        "residuals",
        lambda self, v: bent(np.array([v["x"] - 0.2, v["y"] - 0.2, v["x"] + v["y"] - 0.9, 0.0]) / 0.1),
    )
    table = minimal_conflicts(square, {}, ["A", "B", "C"], STARTS, ROUNDS, method="trf").set_index("claims")
    assert table.index[table["conflict"]].tolist() == ["A B C"]
    assert table.loc["A B C", "approach"] == pytest.approx(5 / 3, abs=0.2)


def test_the_search_is_aimed_at_the_set():
    """Claims that are not asked for do not draw it away."""
    near, _, x = approach(square, {}, ["D", "B"], STARTS, ROUNDS, method="trf")
    assert near < 0.05
    assert x == pytest.approx([0.9, 0.7], abs=0.01)


def test_groups_that_are_not_there_are_refused():
    with pytest.raises(InputError, match="each of A, B, C, D once"):
        minimal_conflicts(square, {}, ["A", "E"], STARTS, ROUNDS)
