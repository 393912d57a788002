"""The engine of rows with made-up ones: states, processes, and what a kill costs."""

import json
import sys

import pytest

from trackdyn.errors import TrackdynError
from trackdyn.sweeps import engine
from trackdyn.sweeps.engine import refuse_failed, results
from trackdyn.sweeps.store import key_of

# A row is refused, diverges, fails or kills its process at its first attempt, as it is told.
MADE_UP = """
import os, pathlib, signal
from trackdyn.errors import DivergenceError, InputError

def maker(memory):
    return compute

def compute(number, ends="", flag=""):
    if ends == "killed" and not pathlib.Path(flag).exists():
        pathlib.Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if ends == "refused":
        raise InputError("no such rig")
    if ends == "diverged":
        raise DivergenceError("it flew apart")
    if ends == "failed":
        return {"of a kind that no row has": object()}["another"]
    return {"third": number / 3, "missing": float("nan")}
"""


@pytest.fixture
def maker(tmp_path, monkeypatch):
    (tmp_path / "made_up_rows.py").write_text(MADE_UP, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "made_up_rows", raising=False)
    import made_up_rows

    return made_up_rows.maker


def tasks(*asked):
    return {key_of(task, "sources"): task for task in asked}


def states(found):
    return [(row["state"], row["reason"], sorted(row["values"])) for row in found]


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_comes_of_a_row_is_its_state(maker, tmp_path, jobs):
    asked = tasks(*({"number": 1, "ends": ends} for ends in ("", "refused", "diverged", "failed")))
    found = results(maker, asked, jobs, tmp_path / "store")
    assert states(found[key] for key in asked) == [
        ("done", "", ["missing", "third"]),
        ("refused", "no such rig", []),
        ("diverged", "it flew apart", []),
        ("failed", "KeyError: \"'another'\"", []),
    ]
    with pytest.raises(TrackdynError, match=r"may pass \(KeyError: .*\); try again"):
        refuse_failed(found.values(), "try again")
    refuse_failed([row for row in found.values() if row["state"] != "failed"], "try again")


def test_a_killed_process_costs_one_row_and_the_next_run_that_row_only(maker, tmp_path, monkeypatch):
    asked = tasks(*({"number": k, "ends": "killed" if k == 3 else "", "flag": str(tmp_path / "f")} for k in range(8)))
    first = results(maker, asked, 2, tmp_path / "store")
    (lost,) = [key for key, row in first.items() if row["state"] != "done"]
    assert asked[lost]["number"] == 3 and first[lost]["state"] == "failed" and "SIGKILL" in first[lost]["reason"]
    computed, outcome = [], engine.outcome
    monkeypatch.setattr(engine, "outcome", lambda compute, *row: computed.append(row[0]) or outcome(compute, *row))
    again = results(maker, asked, 2, tmp_path / "store")
    assert computed == [lost]
    alone = results(maker, asked, 1)
    assert json.dumps({key: again[key]["values"] for key in asked}) == json.dumps(
        {key: alone[key]["values"] for key in asked}
    )
