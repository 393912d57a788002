"""Sweeps as a module, and the profiles."""

import os
import sys
from contextlib import nullcontext
from itertools import pairwise
from types import SimpleNamespace

import pandas as pd
import pytest
from snakemake.iocontainers import Namedlist

from tests.conftest import RIG, ROOT, run_python, written
from trackdyn.inputs.errors import TrackdynError
from trackdyn.jit import cache_folder
from trackdyn.sweeps import batch_jobs
from trackdyn.sweeps.sweep import batches, sweep

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
# Each program of a SLURM of its own: the first job is killed, every other one is run while it is handed in.
SLURM = """#!{python}
import subprocess, sys
from itertools import dropwhile
from pathlib import Path

program, words = Path(sys.argv[0]), sys.argv[1:]
states = program.parent / "states"
if program.name == "sbatch":
    before = states.read_text().splitlines() if states.exists() else []
    command, state = next(word for word in words if word.startswith("--wrap=")).partition("=")[2], "NODE_FAIL"
    if before:
        log = open(words[words.index("--output") + 1].replace("%j", str(len(before) + 1)), "w")
        done = subprocess.run(command, shell=True, stdout=log, stderr=log)
        state = "FAILED" if done.returncode else "COMPLETED"
    states.open("a").write(f"{{len(before) + 1}}|{{state}}\\n")
    Path(program.parent, "calls").open("a").write(" ".join(words[: words.index("-D")]) + "\\n")
    print(len(before) + 1)
elif program.name == "srun":
    sys.exit(subprocess.run([*dropwhile(lambda word: word.startswith("-"), words)]).returncode)
elif program.name == "squeue":
    print(states.read_text())
elif program.name == "scontrol":
    print("MinJobAge = 600 sec")
"""


def snakemake(folder, *arguments):
    environment = {"XDG_CACHE_HOME": folder / "cache", "TRACKDYN_CACHE": cache_folder().parent, "PYTHONPATH": ROOT}
    path = f"{folder / 'bin'}:{os.environ['PATH']}"
    return run_python("-m", "snakemake", "--nocolor", *arguments, cwd=folder, PATH=path, **environment)


def test_a_module_gives_the_bytes_of_one_sweep(tmp_path):
    """With rows that stand twice and rows that are refused, in a Snakefile of somebody's own."""
    design = pd.DataFrame([{"motor_rpm": rpm, "ring_radius": 0.308, **SCENE} for rpm in (115, 210, 115, "no")])
    design.to_csv(tmp_path / "d.csv", index=False)
    written(tmp_path / "Snakefile", MODULE.format(root=ROOT))
    done = snakemake(tmp_path, "-j2", "--quiet")
    assert done.code == 0, done
    single = sweep(tmp_path / "d.csv", tmp_path / "single.csv", RIG, jobs=1)
    assert single.state.tolist() == ["done"] * 3 + ["refused"]
    assert (tmp_path / "single.csv").read_bytes() == (tmp_path / "r/s.csv").read_bytes()
    assert "Nothing to be done" in str(snakemake(tmp_path, "-n", "--quiet", "rules"))
    design.assign(motor_rpm=116).to_csv(tmp_path / "d.csv", index=False)
    os.utime(tmp_path / "d.csv", (1e9, 1e9))  # a design of an older date is another one, too
    assert "Nothing to be done" not in str(snakemake(tmp_path, "-n", "--quiet", "rules"))


def test_the_profile_hands_jobs_to_slurm_and_a_job_that_failed_is_reported_and_retried_with_more(tmp_path):
    """Two rows that no kernel runs for, as one batch and its gathering."""
    pytest.importorskip("snakemake_executor_plugin_slurm")
    (tmp_path / "bin").mkdir()
    for name in ("sbatch", "srun", "squeue", "scontrol", "sinfo", "sacct", "sacctmgr", "sshare", "scancel"):
        written(tmp_path / "bin" / name, SLURM.format(python=sys.executable)).chmod(0o755)
    written(tmp_path / "d.csv", "motor_rpm\n0\nno\n")
    profile = ("--workflow-profile", f"{ROOT}/profiles/slurm", "--slurm-init-seconds-before-status-checks", "1")
    config = ("--config", "design=d.csv", "out=r.csv", "batches=1")
    done = snakemake(tmp_path, "-s", f"{ROOT}/workflow/sweep.smk", *profile, *config)
    assert done.code == 0 and "Error in rule batch" in done.err and "NODE_FAIL" in done.err, done
    calls = (tmp_path / "bin" / "calls").read_text(encoding="utf-8").splitlines()
    submitted = [dict(pairwise(call.split())) for call in calls]
    assert [(call["--mem"], call["-t"]) for call in submitted] == [("2000", "120"), ("4000", "240"), ("2000", "120")]
    assert pd.read_csv(tmp_path / "r.csv").state.tolist() == ["refused"] * 2


def test_a_module_without_its_config_names_the_missing_key(tmp_path):
    done = snakemake(tmp_path, "-s", f"{ROOT}/workflow/sweep.smk", "-n", "--config", "out=r.csv")
    assert done.code == 1 and "sweep: design is missing" in str(done) and "Traceback" not in str(done)


def test_batches_hold_every_row_once_and_neighbours_alike():
    """More batches than rows repeat the first row: none is empty."""
    rows = [{"motor_rpm": 115.0 + k, "ring_radius": (0.308, 0.31)[k % 2], **SCENE} for k in range(8)]
    design = pd.DataFrame(rows * 2)
    parts = batches(design, RIG, 2)
    assert [(len(rows), rows.ring_radius.nunique()) for rows in parts] == [(4, 1), (4, 1)]
    assert sorted(pd.concat(parts).motor_rpm) == [115.0 + k for k in range(8)]
    assert [len(rows) for rows in batches(design, RIG, 9)] == [1] * 9


@pytest.mark.parametrize(("attempt", "again"), [(2, True), (3, False)])
def test_a_batch_with_failed_rows_is_tried_again_but_for_the_last_time(tmp_path, monkeypatch, attempt, again):
    design = pd.DataFrame([{"motor_rpm": 115.0, **SCENE}])
    design.to_csv(tmp_path / "d.csv", index=False)
    failed = design.assign(state="failed", reason="out of memory")
    monkeypatch.setattr(batch_jobs, "sweep", lambda *_: failed)
    job = SimpleNamespace(
        input=SimpleNamespace(design=tmp_path / "d.csv", rig=RIG), output=[tmp_path / "r.csv"], threads=1,
        resources=SimpleNamespace(attempt=attempt),
        params=Namedlist(fromdict={"batch": 0, "batches": 1, "retries": 2, "store": tmp_path / "rows"}),
    )  # fmt: skip
    with pytest.raises(TrackdynError, match="1 rows will be tried again: out of m") if again else nullcontext():
        batch_jobs.main(job)
