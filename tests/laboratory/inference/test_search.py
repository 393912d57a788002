"""Searches from many starts on invented problems whose answers are known; no kernel is called."""

import numpy as np
import pytest

from laboratory.inference import search as searches
from laboratory.inference.search import Start, local_searches, minimise
from trackdyn.errors import InputError, TrackdynError

CALLS: list[tuple] = []


def valley(memory):
    """Rosenbrock's residuals, by 4 of x and of y over the unit square: the valley's end lies at (1, 1)."""

    def compute(x, y):
        CALLS.append((x, y))
        return {"far": 10 * (y - x**2), "near": 1 - x}

    return compute


def two_valleys(memory):
    """The minimum at x = 0.2 is 0, the one at 0.8 is not."""

    def compute(x, y):
        return {"far": 40 * (x - 0.2) * (x - 0.8) + 4 * x - 0.8, "near": y - 0.5}

    return compute


class Invented:
    """A problem of two coordinates; ``wall``: where x is larger, nothing runs."""

    sources = "invented"

    def __init__(self, rows=valley, scale=4.0, wall=1.0):
        self.rows, self.scale, self.wall = rows, scale, wall

    def task(self, x):
        if x[0] > self.wall:
            raise InputError("x lies behind the wall")
        at = self.scale * (np.asarray(x) - 0.5) if self.rows is valley else x
        return {"x": float(at[0]), "y": float(at[1])}

    def residuals(self, values):
        return np.array([values["far"], values["near"]])


def split():
    return Invented(two_valleys)


def free(name, *x):
    return Start(name, list(x), [True] * len(x))


@pytest.fixture(autouse=True)
def no_calls():
    CALLS.clear()


@pytest.mark.parametrize("method", ["dfols", "cma"])
def test_both_methods_end_where_the_valley_does(method):
    pytest.importorskip(method)
    minimum = minimise(Invented(), free("a", 0.2, 0.6), 1500, method)
    assert minimum["ended"] == "converged"
    assert minimum["x"] == pytest.approx([0.75, 0.75], abs=0.02)
    assert minimum["cost"] < 1e-3 < minimum["first_cost"]
    assert minimum["evaluations"] == len(minimum["costs"])


@pytest.mark.parametrize("method", ["dfols", "cma"])
def test_what_cannot_run_points_back(method):
    """With a wall before the valley's end the best point lies at the wall."""
    pytest.importorskip(method)
    minimum = minimise(Invented(wall=0.65), free("a", 0.3, 0.6), 1500, method)
    assert 0.6 < minimum["x"][0] <= 0.65
    beyond = searches._Evaluated(Invented(wall=0.65), None, 10)
    costs = [float((r := beyond(np.array([x, 0.5]))) @ r) for x in (0.65, 0.66, 0.7, 0.8)]
    assert np.all(np.diff(costs) > 0)


def test_searches_from_two_starts_find_their_valleys_and_again_from_the_store(tmp_path):
    requested = {name: ({}, free(name, x, 0.4)) for name, x in (("shallow", 0.85), ("deep", 0.3))}
    ends = local_searches(split, requested, 60, store=tmp_path, method="cma")
    assert ends["deep"]["cost"] < ends["shallow"]["cost"]
    assert ends["deep"]["x"][0] == pytest.approx(0.2, abs=0.02)
    assert local_searches(split, requested, 60, store=tmp_path, method="cma") == ends


def test_a_row_that_failed_for_a_passing_reason_stops_the_search():
    def broken(memory):
        def compute(x, y):
            raise OSError("the disk is full")

        return compute

    with pytest.raises(TrackdynError, match="may pass"):
        minimise(Invented(broken), free("a", 0.5, 0.5), 4, "cma")


def test_refusals():
    with pytest.raises(InputError, match="dfols or cma"):
        minimise(Invented(), free("a", 0.5, 0.5), 4, "newton")
