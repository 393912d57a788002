"""The commands about rigs, as a user has them."""

import sys
import warnings
from types import SimpleNamespace

import pytest

from trackdyn.commands import cli
from trackdyn.parameters.rig import load_rig


@pytest.fixture
def run(monkeypatch, capsys):
    """Function that runs a command in a folder and gives its exit code and what it printed."""

    def command(*words, cwd):
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["trackdyn", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as end:
            code = end.code or 0
        said = capsys.readouterr()
        return SimpleNamespace(returncode=code, stdout=said.out, stderr=said.err)

    return command


@pytest.mark.parametrize("name", ["bench", "m113", "paper", "robot", "vehicle"])
def test_a_new_file_is_the_rig_that_it_is_like(name, tmp_path, run):
    done = run("new", "mine.yaml", "--like", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    its = load_rig(name)
    # but for drag of its wheels by laws that it does not have; and a copy was not tried
    wheels = {f"{wheel}." for wheel in its.rollers}
    its = its.changed(**{field: 0.0 for field in its.without_effect if any(map(field.startswith, wheels))})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mine = load_rig(tmp_path / "mine.yaml")
    assert mine.rollers == its.rollers
    assert mine == its
    again = run("new", "mine.yaml", "--like", name, cwd=tmp_path)
    assert (
        again.returncode == 1
        and "mine.yaml exists; give another name" in again.stderr
        and "Traceback" not in again.stderr
    )


def test_simulate_needs_no_file(tmp_path, run):
    done = run("simulate", "run.npz", "--duration", "0.05", "--lead-in", "0", "-q", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    from trackdyn.simulation.recording import load_recording

    meta = load_recording(tmp_path / "run.npz").meta
    assert meta["scene"]["ring_radius"] == load_rig("paper").sprocket.ring_radius
    done = run("simulate", "other.npz", "--rig", "nowhere", cwd=tmp_path)
    assert done.returncode == 1 and "trackdyn rigs" in done.stderr


def test_a_groove_that_another_tooth_left_behind_is_reported(tmp_path, run):
    """One that comes by ``like`` from a sprocket of another tooth, through a file between; and none if it fits."""
    (tmp_path / "first.yaml").write_text(
        "like: bench\nsprocket: {source: x, teeth: 15, equal_pitch_radius: 0.354 m, ring_radius: 0.354 m}\n"
    )
    (tmp_path / "second.yaml").write_text("like: first.yaml\n")
    (tmp_path / "fits.yaml").write_text("like: bench\n")
    for name, reported in (("first", True), ("second", True), ("fits", False)):
        done = run("check", f"{name}.yaml", "--no-settle", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert ("the groove is that of " in done.stdout and "this rig has 15 teeth" in done.stdout) == reported
