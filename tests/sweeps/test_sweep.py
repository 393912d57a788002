"""A sweep: states of its rows, and that no row is lost or computed twice."""

import os
import signal
import subprocess
import sys
import time
from hashlib import sha256

import numpy as np
import pandas as pd
import pytest

from tests.conftest import RIG, ROOT, refused
from trackdyn.measure.metrics import run_metrics
from trackdyn.scene.choices import preset
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps import engine
from trackdyn.sweeps.engine import Store
from trackdyn.sweeps.sweep import sweep

SHORT = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.05, "preset": "fast"}


def design(rows=4, **fields):
    return pd.DataFrame([{"motor_rpm": 115.0 + 5 * k} | SHORT | fields for k in range(rows)])


@pytest.fixture
def counted(monkeypatch):
    """Rows that were due, by key."""
    due, run = [], engine._run_in_pools
    monkeypatch.setattr(engine, "_run_in_pools", lambda _, tasks, *rest: due.extend(tasks) or run(_, tasks, *rest))
    return due


def test_a_row_has_the_metrics_of_its_scene(make_scene):
    table = sweep(design(2, ring_radius=0.31), rig=RIG, jobs=1)
    times = {name: SHORT[name] for name in ("duration", "lead_in", "ramp")}
    for k, rpm in enumerate((115.0, 120.0)):
        values = run_metrics("", simulate(make_scene(rpm, ring_radius=0.31, **times, **preset("fast"))))
        for name in values.keys() - {"run"}:
            value = values[name]
            assert value == table[name][k] or (pd.isna(value) and pd.isna(table[name][k])), name


def test_broken_rows_have_reasons_and_stop_no_others(tmp_path):
    rows = {
        "": {},
        "motor_rpm = 'fast': must be a finite number": {"motor_rpm": "fast"},
        "motor_rpm = [1.0, 2.0]: must be a finite number": {"motor_rpm": np.array([1, 2])},
        "motor_rpm = 1000": {"motor_rpm": 10**400},
        "chain.link_mass = -1": {"chain.link_mass": "-1"},
        "the loop of 20 pitches (chain.pitches) is": {"chain.pitches": "20"},
        "preset = 'quick':": {"preset": "quick"},
        "friction = 'some'": {"friction": "some"},
        "step = 0.0005:": {"duration": "36000", "every_link": "true", "step": "0.0005", "sensor.rate": "100000000"},
        "stop_rule: force = -0.01": {"stop_rule.force": "-0.01"},
        "stop_rule: force = 'x':": {"stop_rule.force": "x", "stop_rule.passages": "13"},
    }
    short = {name: str(value) for name, value in SHORT.items()}
    table = pd.DataFrame([{"motor_rpm": "115"} | short | row for row in rows.values()])
    swept = sweep(table.fillna(""), tmp_path / "r.csv", RIG, jobs=1)
    assert swept.state.tolist() == ["done"] + ["refused"] * (len(rows) - 1)
    for words, reason in zip(rows, swept.reason, strict=True):
        assert words in reason and "\n" not in reason and bool(words) == bool(reason), reason
    assert pd.read_csv(tmp_path / "r.csv", keep_default_na=False).reason.tolist() == swept.reason.tolist()


def test_nothing_is_computed_twice(tmp_path, counted):
    twice = pd.concat([design(3), design(2)])  # two rows stand twice
    for table, computed in ((twice, 3), (twice, 3), (design(5), 5)):
        assert sweep(table, tmp_path / "r.csv", RIG, jobs=1).key.nunique() == len(counted) == computed


def test_damaged_and_foreign_rows_of_a_store_are_counted_and_computed_again(tmp_path, counted, capsys):
    """A torn row, rows without a checksum, and another row's."""
    out = tmp_path / "r.csv"
    whole = sweep(design(3), out, RIG, jobs=1)
    file, other, _ = sorted((tmp_path / "r.rows").iterdir())
    content = file.read_bytes()
    foreign = [b"", content[:-1], content[:80] + b"x" + content[81:], content[65:], other.read_bytes()]
    foreign += [sha256(line).hexdigest().encode() + b"\n" + line + b"\n" for line in (b"{", b"null", b"\xff")]
    capsys.readouterr()
    for damaged in foreign:
        file.write_bytes(damaged)
        assert Store(file.parent).read([file.stem]) == {}, damaged[64:200]
        assert capsys.readouterr().err.endswith("1 damaged row was ignored; they are computed again\n")
    pd.testing.assert_frame_equal(whole, sweep(design(3), out, RIG, jobs=1))
    assert counted[3:] == [file.stem]


@pytest.mark.parametrize(("arguments", "message"), [
    ({"design": [1, 2]}, "design = [1, 2]:"), ({"design": pd.DataFrame({0: [1]})}, "a column without a name"),
    ({"jobs": 0}, "jobs = 0:"), ({"out": "r.txt"}, "out = 'r.txt':"), ({"out": "/proc/r.csv"}, "cannot be written"),
    ({"rig": "no.yaml"}, "no.yaml: no such file"),
])  # fmt: skip
def test_a_sweep_refuses_invalid_arguments(arguments, message):
    refused(sweep, words=[message], **{"design": design(1), "rig": RIG} | arguments)


def test_every_link_gives_measures_with_errors():
    swept = sweep(design(1, motor_rpm=210.0, duration=1.0, every_link=True), rig=RIG, jobs=1)
    assert swept.state.tolist() == ["done"], swept.reason.tolist()
    assert (swept.whole_rms > 0).all() and (swept.whole_rms_error > 0).all()


def test_a_row_takes_the_first_of_its_steps_that_comes_out():
    """1e-3 s is beyond the limit of the contacts, and 2e-3 s beyond any step."""
    several, single = (
        sweep(design(3).assign(preset=None, step=steps), rig=RIG, jobs=1)
        for steps in (["0.001 0.0001", "0.0001", "0.002; 0.001"], [1e-4, 1e-4, 1e-3])
    )
    assert several.state.tolist() == single.state.tolist() == ["done", "done", "refused"], several.reason.tolist()
    assert several.step_s[0] == 1e-4 and several.rms_g[0] == single.rms_g[0]
    assert several.reason[2] == single.reason[2]


# Rows that wait until there are fewer rows in the store than a file of the test allows.
WAITING = """
import os, pathlib, time
from trackdyn.sweeps import sweep, sweep_row

def run_row(**task):
    folder, limit = map(pathlib.Path, (os.environ["STORE"], os.environ["LIMIT"]))
    while len(list(folder.glob("[!.]*.json"))) >= int(limit.read_text()):
        time.sleep(0.01)
    return sweep_row.run_row(**task)

sweep.run_row = run_row
"""
RUN = "import waiting; from trackdyn.__main__ import main; main()"


def test_a_killed_sweep_goes_on_where_it_was(tmp_path):
    """Killed, then interrupted by Ctrl-C, which is for the whole group; two processes end in the bytes of one."""
    designed, out, store, limit = (tmp_path / name for name in ("d.csv", "r.csv", "r.rows", "limit"))
    design(8).to_csv(designed, index=False)
    (tmp_path / "waiting.py").write_text(WAITING, encoding="utf-8")
    environment = {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}", "STORE": str(store), "LIMIT": str(limit)}

    def stored_rows():
        return len(list(store.glob("[!.]*.json")))

    def begin(most):
        """The command in a group of its own, whose rows wait where ``most`` are stored."""
        limit.write_text(str(most), encoding="utf-8")
        line = map(str, [sys.executable, "-c", RUN, "sweep", designed, "--out", out, "--rig", RIG, "-j2", "-q"])
        options = {"start_new_session": True, "stderr": subprocess.PIPE, "env": os.environ | environment}
        return subprocess.Popen([*line], **options)

    for end, most in ((signal.SIGKILL, 2), (signal.SIGINT, 4)):
        process = begin(most)
        while stored_rows() < most:
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)
        (os.killpg if end == signal.SIGINT else os.kill)(process.pid, end)
        errors = process.communicate()[1]  # also of the processes that it started, which end with it
        assert not out.exists() and most <= stored_rows() < 8
        assert len(errors.split(b"\n")) <= 3 and b"Traceback" not in errors, errors
    assert process.returncode == 130, errors
    assert errors.lstrip().startswith(b"trackdyn: interrupted")
    process = begin(9)
    assert (process.wait(), process.communicate()[1]) == (0, b"")
    sweep(pd.read_csv(designed), tmp_path / "single.csv", RIG, jobs=1)
    assert stored_rows() == 8 and out.read_bytes() == (tmp_path / "single.csv").read_bytes()
