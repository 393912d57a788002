"""The engine of rows with made-up ones: states, processes, kills."""

import json
import os
import subprocess
import sys

import pytest

from tests.conftest import refused, run_python, written
from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.files import MACHINE
from trackdyn.sources import module_files, module_hash
from trackdyn.sweeps import engine
from trackdyn.sweeps.engine import check_completed, key_of, results

# A row is refused, diverges, fails or kills its process, once or always, as it is told.
MADE_UP = """
import os, pathlib, signal, time
from trackdyn.inputs.errors import DivergenceError, InputError

def compute(number, ends="", flag=""):
    if ends == "waits for the others":
        while len(os.listdir(flag)) < 3:
            time.sleep(0.01)
    if ends == "killed" or ends == "killed once" and not pathlib.Path(flag).exists():
        pathlib.Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if ends == "refused":
        raise InputError("no such rig")
    if ends == "diverged":
        raise DivergenceError("it flew apart")
    if ends == "failed":
        return {"of a kind that no row has": object()}["another"]
    return {"third": number / 3, "missing": float("nan")}

def blocked():
    return {"blocked": [number.name for number in signal.pthread_sigmask(signal.SIG_BLOCK, [])]}
"""
BLOCKED = """
import made_up_rows
from trackdyn.sweeps.engine import results

rows = results(made_up_rows.blocked, {str(k): {} for k in range(4)}, 2)
print([row["values"]["blocked"] for row in rows.values()])
"""


@pytest.fixture
def compute(tmp_path, monkeypatch):
    (folder := tmp_path / "program").mkdir()
    os.utime(written(folder / "made_up_rows.py", MADE_UP), (0, 0))  # or it was edited after this process began
    for cached in (module_files, module_hash):
        cached.cache_clear()
    monkeypatch.setenv("PYTHONPATH", str(folder))
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "made_up_rows", raising=False)
    import made_up_rows

    return made_up_rows.compute


def tasks(count, ends=None, flag=""):
    """So many rows by key, which end as ``ends`` says by number."""
    due = ({"number": k, "ends": (ends or {}).get(k, ""), "flag": str(flag)} for k in range(count))
    return {key_of(task, "sources"): task for task in due}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_row_has_the_state_of_its_computation(compute, tmp_path, jobs):
    due = tasks(4, {1: "refused", 2: "diverged", 3: "failed"})
    rows = results(compute, due, jobs, tmp_path / "store")
    assert [(rows[key]["state"], rows[key]["reason"], sorted(rows[key]["values"])) for key in due] == [
        ("done", "", ["missing", "third"]),
        ("refused", "no such rig", []),
        ("diverged", "it flew apart", []),
        ("failed", "KeyError: \"'another'\"", []),
    ]
    words = ["may pass (KeyError: ", "); try again"]
    refused(check_completed, rows.values(), "try again", words=words, error=TrackdynError)
    check_completed([row for row in rows.values() if row["state"] != "failed"], "try again")


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(("old", "new", "reason"), [
    ("number / 3", "number / 4", "the program was edited while it ran; start it again: stored rows are reused"),
    ("import os", "# one\nimport os", ""),
], ids=["code", "comment"])  # fmt: skip
def test_no_row_is_stored_under_the_key_of_other_sources(compute, tmp_path, jobs, old, new, reason):
    results(compute, tasks(2), jobs, tmp_path / "before")
    written(tmp_path / "program" / "made_up_rows.py", MADE_UP.replace(old, new))
    rows = results(compute, tasks(2), jobs, tmp_path / "store")
    assert {(row["state"], row["reason"]) for row in rows.values()} == {("failed" if reason else "done", reason)}
    assert len(list((tmp_path / "store").iterdir())) == (0 if reason else 2)


def test_an_interrupt_is_not_for_the_processes_of_a_pool(compute):
    """Run in a new process: in this one an earlier test may have started the tracker already."""
    run = run_python("-c", BLOCKED)
    assert run.out.split("\n")[0] == str([["SIGINT"]] * 4), run.err


@pytest.mark.parametrize(("jobs", "killed"), [(1, 9), (2, 0)])
def test_a_row_that_kills_its_process_once_is_computed_in_the_same_call(compute, tmp_path, monkeypatch, jobs, killed):
    """Its bytes are those of rows that nobody disturbed."""
    due = tasks(24, {killed: "killed once"}, tmp_path / "f")
    rows = results(compute, due, jobs, tmp_path / "store")
    undisturbed = results(compute, due, 1)
    assert json.dumps([rows[key]["values"] for key in due]) == json.dumps([undisturbed[key]["values"] for key in due])
    assert sorted(path.name for path in (tmp_path / "store").iterdir()) == sorted(f"{key}.json" for key in due)
    monkeypatch.setattr(engine, "_run_in_pools", lambda _, due, *rest: iter([]) if not due else pytest.fail("again"))
    assert json.dumps(results(compute, due, jobs, tmp_path / "store")) == json.dumps({key: rows[key] for key in due})


@pytest.mark.parametrize(("jobs", "killing"), [(1, {0}), (2, {5, 20}), (4, {0})])
def test_a_row_that_kills_its_process_always_fails_and_the_others_are_done(compute, tmp_path, jobs, killing):
    due, store = tasks(24, dict.fromkeys(killing, "killed"), tmp_path / "f"), tmp_path / "store"
    rows = results(compute, due, jobs, store)
    failed = [row["reason"] for row in rows.values() if row["state"] == "failed"]
    assert {k for k, key in enumerate(due) if rows[key]["state"] == "failed"} == killing
    assert all(reason.startswith("2 of its processes were ended (SIGKILL(-9)), perhaps out of") for reason in failed)
    assert len(rows) == 24 and len(list(store.iterdir())) == 24 - len(killing)


def test_rows_of_a_sweep_that_was_killed_with_its_processes_are_computed_last(compute, tmp_path):
    """A mark of a process of this machine that is gone; one that runs, or is elsewhere, counts for nothing."""
    first, second, third, _ = due = tasks(4)
    (store := tmp_path / "store").mkdir()
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    for name in (f"{first}.{MACHINE}-{gone.pid}", f"{second}.{MACHINE}-{os.getpid()}", f"{third}.other-{gone.pid}"):
        (store / f".{name}.trackdyn-row").touch()
    assert [*results(compute, due, 1, store)] == [*due][1:] + [first]
    assert not (store / f".{first}.{MACHINE}-{gone.pid}.trackdyn-row").exists()


def test_a_long_row_holds_back_no_others(compute, tmp_path):
    """Rows are counted as they come, although the first one waits until the others are stored."""
    due = tasks(4, {0: "waits for the others"}, tmp_path / "store")
    assert next(iter(results(compute, due, 2, tmp_path / "store"))) != next(iter(due))


def test_processes_that_cannot_start_are_named(compute, tmp_path, monkeypatch):
    written(tmp_path / "program" / "made_up_rows.py", "import os; os._exit(1)")
    refused(results, compute, tasks(3), 2, error=TrackdynError, words=["a process was ended (EXIT(1)"])
