"""A type checker sees the types of the public functions in a user's script, and errors against them."""

import pytest

from tests.conftest import ROOT, written

SCRIPT = """
import numpy as np

from trackdyn import Loop, Recording, Rig, Scene, SensorMapping, load_recording, load_rig, read_sensor, sense, simulate

rig: Rig = load_rig("paper")
scene: Scene = Scene(rig, motor_rpm=115, duration=20.0).with_(ramp=0.5)
recording: Recording = simulate(scene)
recording.save("run.npz")
ay: np.ndarray = sense(load_recording("run.npz"), every=2).ay
step: float = scene.time_step
pitches: tuple[int, ...] = scene.pitches
teeth: int = rig.sprocket.teeth
energy: dict[str, float] = Loop(scene).energy
measured: np.ndarray = read_sensor("logger.csv", SensorMapping(unit="g")).ay
"""
WRONG = (
    'from trackdyn import Scen', 'load_rig(3)', 'simulate(rig)', 'Scene(scene, motor_rpm=115)',
    'text: str = scene.time_step', 'name: str = rig.sprocket.teeth', 'sense(recording, every="2")',
    'signal: float = sense(recording)', 'energies: float = Loop(scene).energy', 'recording.rates',
    'read_sensor("logger.csv", 3)', 'text: str = read_sensor("logger.csv").ay',
)  # fmt: skip


def test_a_users_script_is_checked_against_the_package(tmp_path, monkeypatch):
    api = pytest.importorskip("mypy.api")
    assert (ROOT / "trackdyn" / "py.typed").is_file()
    monkeypatch.setenv("MYPYPATH", str(ROOT))
    script = written(tmp_path / "script.py", SCRIPT + "\n".join(WRONG) + "\n")
    options = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(ROOT / ".mypy_cache"), "--no-pretty"]
    report, failure, _ = api.run([*options, str(script)])
    assert not failure, failure
    first = 1 + SCRIPT.count("\n")
    lines = {int(line.split(":")[1]) for line in report.splitlines() if "script.py" in line and ": error:" in line}
    assert lines == set(range(first, first + len(WRONG))), report
