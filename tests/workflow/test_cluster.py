"""Sweeps as a module, and the profiles."""

import os
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from snakemake.iocontainers import Namedlist

from tests.conftest import RIG
from trackdyn.inputs.errors import TrackdynError
from trackdyn.jit import cache_folder
from trackdyn.sweeps import batch_jobs
from trackdyn.sweeps.sweep import batches, sweep

ROOT = Path(__file__).parents[2]
SCENE = {"preset": "fast", "duration": 0.05, "lead_in": 0.0, "ramp": 0.05}
MODULE = """
module sweep:
    snakefile: "{root}/workflow/sweep.smk"
    config: {{"design": "d.csv", "out": "r/s.csv", "batches": 2, "rig": "{root}/tests/viscous.yaml"}}

use rule * from sweep as sweep_*

rule mine:
    default_target: True
    input: rules.sweep_gather.output
"""


def snakemake(folder, *arguments):
    caches = {"XDG_CACHE_HOME": str(folder / "cache"), "TRACKDYN_CACHE": str(cache_folder().parent)}
    return subprocess.run(
        [sys.executable, "-m", "snakemake", "--nocolor", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | caches,
        capture_output=True,
        text=True,
    )


def test_a_module_gives_the_bytes_of_one_sweep(tmp_path):
    """With rows that stand twice and rows that are refused, in a Snakefile of somebody's own."""
    design = pd.DataFrame([{"motor_rpm": rpm, "ring_radius": 0.308, **SCENE} for rpm in (115, 210, 115, "no")])
    design.to_csv(tmp_path / "d.csv", index=False)
    (tmp_path / "Snakefile").write_text(MODULE.format(root=ROOT), encoding="utf-8")
    result = snakemake(tmp_path, "-j2", "--quiet")
    assert result.returncode == 0, result.stdout + result.stderr
    alone = sweep(tmp_path / "d.csv", tmp_path / "alone.csv", RIG, jobs=1)
    assert alone.state.tolist() == ["done"] * 3 + ["refused"]
    assert (tmp_path / "alone.csv").read_bytes() == (tmp_path / "r/s.csv").read_bytes()
    again = snakemake(tmp_path, "-n", "--quiet", "rules")
    assert "Nothing to be done" in again.stdout + again.stderr
    design.assign(motor_rpm=116).to_csv(tmp_path / "d.csv", index=False)
    os.utime(tmp_path / "d.csv", (1e9, 1e9))
    other = snakemake(tmp_path, "-n", "--quiet", "rules")
    assert "Nothing to be done" not in other.stdout + other.stderr, "a design of an older date is another one, too"


def test_a_module_without_its_config_says_what_is_missing(tmp_path):
    result = snakemake(tmp_path, "-s", f"{ROOT}/workflow/sweep.smk", "-n", "--config", "out=r.csv")
    printed = result.stdout + result.stderr
    assert result.returncode == 1 and "sweep: design is missing" in printed and "Traceback" not in printed


def test_batches_hold_every_row_once_and_neighbours_alike(rig_path):
    """More batches than rows repeat the first row: none is empty."""
    design = pd.DataFrame(
        [{"motor_rpm": 115.0 + k, "ring_radius": (0.308, 0.31)[k % 2], **SCENE} for k in range(8)] * 2
    )
    parts = batches(design, rig_path, 2)
    assert [len(rows) for rows in parts] == [4, 4]
    assert sorted(pd.concat(parts).motor_rpm) == [115.0 + k for k in range(8)]
    assert [rows.ring_radius.nunique() for rows in parts] == [1, 1]
    assert [len(rows) for rows in batches(design, rig_path, 9)] == [1] * 9


@pytest.mark.parametrize(("attempt", "again"), [(2, True), (3, False)])
def test_a_batch_with_failed_rows_is_tried_again_but_for_the_last_time(tmp_path, rig_path, monkeypatch, attempt, again):
    design = pd.DataFrame([{"motor_rpm": 115.0, **SCENE}])
    design.to_csv(tmp_path / "d.csv", index=False)
    monkeypatch.setattr("trackdyn.simulation.recorder.virtual_memory", lambda: SimpleNamespace(available=1000))
    job = SimpleNamespace(
        input=SimpleNamespace(design=tmp_path / "d.csv", rig=rig_path), output=[tmp_path / "r.csv"], threads=1,
        resources=SimpleNamespace(attempt=attempt),
        params=Namedlist(fromdict={"batch": 0, "batches": 1, "retries": 2, "store": tmp_path / "rows"}),
    )  # fmt: skip
    with pytest.raises(TrackdynError, match="1 rows are to be tried again") if again else nullcontext():
        batch_jobs.main(job)
    assert pd.read_csv(tmp_path / "r.csv").state.tolist() == ["failed"]
