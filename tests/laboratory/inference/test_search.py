"""Searches from many starts on invented problems whose answers are known; no kernel is called."""

import numpy as np
import pytest

from laboratory.inference import search as searches
from laboratory.inference.search import Round, Start, bent, ends_table, minimise, search
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


@pytest.mark.parametrize("method", ["dfols", "trf"])
def test_both_methods_end_where_the_valley_does(method):
    if method == "dfols":
        pytest.importorskip("dfols")
    found = minimise(Invented(), free("a", 0.2, 0.6), 400, method)
    assert found["ended"] == "converged"
    assert found["x"] == pytest.approx([0.75, 0.75], abs=0.02)
    assert found["cost"] < 1e-3 < found["first_cost"]
    assert found["evaluations"] == len(found["costs"])


def test_a_longer_search_begins_as_the_shorter_one_and_repeats_nothing(tmp_path):
    short = minimise(Invented(), free("a", 0.2, 0.6), 7, "trf", store=tmp_path)
    assert (short["ended"], short["evaluations"], len(CALLS)) == ("budget", 7, 7)
    long = minimise(Invented(), free("a", 0.2, 0.6), 20, "trf", store=tmp_path)
    assert long["costs"][:7] == short["costs"]
    assert len(CALLS) == 20  # seven of them came out of the store


@pytest.mark.parametrize("method", ["dfols", "trf"])
def test_what_cannot_run_points_back(method):
    """With a wall before the valley's end the best point lies at the wall."""
    if method == "dfols":
        pytest.importorskip("dfols")
    found = minimise(Invented(wall=0.65), free("a", 0.3, 0.6), 300, method)
    assert 0.6 < found["x"][0] <= 0.65
    beyond = searches._Evaluated(Invented(wall=0.65), None, 10, None)
    costs = [float((r := beyond(np.array([x, 0.5]))) @ r) for x in (0.65, 0.66, 0.7, 0.8)]
    assert np.all(np.diff(costs) > 0)


def test_the_start_in_the_deeper_valley_wins_and_the_worst_is_dropped(tmp_path):
    starts = [free("shallow", 0.85, 0.4), free("deep", 0.3, 0.4), free("far", 1.0, 0.9)]
    rounds = [Round(evaluations=3, keep=2), Round(evaluations=60)]
    ends = search(split, {}, starts, rounds, "trf", store=tmp_path, log=lambda _: None)
    assert [end.start for end in ends] == ["deep", "shallow", "far"]
    assert [end.round for end in ends] == [2, 2, 1]
    assert ends[0].x[0] == pytest.approx(0.2, abs=0.01)
    assert ends[2].evaluations == 3
    again = search(split, {}, starts, rounds, "trf", store=tmp_path, log=lambda _: None)
    assert again == ends
    assert ends_table(ends)["start"].tolist() == ["deep", "shallow", "far"]


def test_a_row_that_failed_for_a_passing_reason_stops_the_search():
    def broken(memory):
        def compute(x, y):
            raise OSError("the disk is full")

        return compute

    with pytest.raises(TrackdynError, match="may pass"):
        minimise(Invented(broken), free("a", 0.5, 0.5), 4, "trf")


def test_bent_residuals_rise_everywhere_and_are_plain_near_zero():
    off = np.array([-1e4, -100, -1, 0, 0.1, 1, 100, 1e4])
    assert np.all(np.diff(bent(off)) > 0)
    assert bent(0.1) == pytest.approx(0.1, rel=1e-3)
    assert abs(bent(100)) < 15
