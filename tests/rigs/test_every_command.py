"""Every command that takes a rig, on every shipped rig and on a new file like each of them."""

import sys

import numpy as np
import pandas as pd
import pytest

from laboratory.inference.identification import experiment
from laboratory.inference.identification.experiment import MeasuredSpeed
from tests.laboratory.inference.conftest import closed_form_ay
from tests.rigs.conftest import scene_of
from trackdyn.commands import cli
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.scene.scene import Scene
from trackdyn.sensor.sensor_csv import write_sensor_csv
from trackdyn.simulation.cost import cost
from trackdyn.simulation.recording import load_recording

pytestmark = pytest.mark.slow


@pytest.fixture
def command(tmp_path, monkeypatch, capsys):
    """Function that runs a command in an empty folder: exit code 0, and what was printed."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["trackdyn", *map(str, words)])
        try:
            cli.main()
        except SystemExit as end:
            assert not end.code, (words, capsys.readouterr().err)
        return capsys.readouterr().out

    return run


FILES = [(name, fresh) for name in shipped_rigs() for fresh in (False, True)]


def in_words(one):
    return f"{'new-like-' if one[1] else ''}{one[0]}"


@pytest.fixture(params=FILES, ids=in_words)
def file(request, command, tmp_path):
    """A shipped rig's file, or one that ``trackdyn new`` has just written."""
    name, fresh = request.param
    if not fresh:
        return shipped_rigs()[name]
    command("new", "mine.yaml", "--like", name)
    return tmp_path / "mine.yaml"


def held(recording):
    """Bytes of all arrays whose length is the number of samples."""
    arrays = (getattr(recording, name) for name in recording.ARRAYS if name not in ("begin", "spells", "pitches"))
    return sum(array.nbytes for array in arrays)


def test_it_is_checked_and_simulated_as_a_belt_as_large_as_forecast(file, command, tmp_path):
    rig = load_rig(file)
    assert "wrap of sprocket" in command("check", file, "--no-settle", "--out", "it.png")
    belt = ("--choose", "chain=belt", "--ring-radius", "none", "--duration", 2)
    command("simulate", "it.npz", "--rig", file, "--rpm", 115, *belt, "--quiet")
    recording = load_recording(tmp_path / "it.npz")
    assert recording.wheel_rate.shape == (2 * rig.sensor.rate, 1 + len(rig.rollers))
    scene = Scene(rig, 115.0, ring_radius=None, duration=2.0, frame_interval=0.0, spells=False, chain="belt")
    # a belt records no pitch where one is forecast
    assert held(recording) <= cost(scene).file < 1.2 * held(recording)


def test_a_sweep_changes_a_wheel_by_its_name(file, command):
    wheel = f"{list(load_rig(file).rollers)[-1]}.bearing_drag"
    row = {"motor_rpm": 115, "chain": "belt", "ring_radius": "none", "spells": False, "duration": 4, wheel: 5.0}
    pd.DataFrame([row]).to_csv("design.csv", index=False)
    command("sweep", "design.csv", "--out", "results.csv", "--rig", file, "--jobs", 1, "--quiet")
    assert pd.read_csv("results.csv")["state"].tolist() == ["done"]


# that every new file takes what is identified is tested above, without the search
@pytest.mark.parametrize(
    "file", [one for one in FILES if one == ("m113", True) or not one[1]], ids=in_words, indirect=True
)
def test_a_stiffness_is_identified_from_a_record(file, command, tmp_path, monkeypatch):
    """The whole command, with simulations in closed form: a stiffness 1.3 times the rig's is within its interval."""
    rig = load_rig(file)
    rpm, present = scene_of(rig).motor_rpm, rig.bushing.stiffness

    def ay_of(rig, *what):
        """The closed form is of a stiffness near 600; the robot's is 0.02."""
        return closed_form_ay(rig.changed(bushing__stiffness=600 * rig.bushing.stiffness / present), *what)

    monkeypatch.setattr(experiment, "simulated_ay", ay_of)
    ay = ay_of(rig.changed(bushing__stiffness=1.3 * present), MeasuredSpeed(rpm, rig.ring_radius, 1000), 7)
    ay += 0.005 * np.random.default_rng(5).standard_normal(ay.size)
    write_sensor_csv(tmp_path / "it.csv", np.arange(ay.size) / 1000, None, ay, None)
    unknown = f"bushing.stiffness={0.5 * present}:{2 * present}"
    small = ("--simulations", 16, "--waves", 1, "--steps", 300, "--jobs", 1)
    command("identify", "it.csv", "--rig", file, "--rpm", rpm, "--unknown", unknown, *small, "--quiet")
    found = pd.read_csv(tmp_path / "identified" / "unknowns.csv").iloc[0]
    assert found["q05"] < 1.3 * present < found["q95"] and found["verdict"] == "identified"
    best = load_rig(tmp_path / "identified" / "rig.yaml")
    assert best == rig.changed(bushing__stiffness=best.bushing.stiffness) != rig
    assert "bushing.stiffness is " in (tmp_path / "identified" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", shipped_rigs())
def test_a_shipped_rig_runs_on_its_chain(name, command, tmp_path):
    rig = load_rig(name)
    scene = scene_of(rig)
    words = (
        "--rpm",
        scene.motor_rpm,
        "--step",
        scene.step,
        "--lead-in",
        0,
        "--duration",
        0.01,
        "--frame-interval",
        0,
        "--quiet",
    )
    command("simulate", "it.npz", "--rig", name, *words)
    recording = load_recording(tmp_path / "it.npz")
    assert recording.wheel_rate.shape[1] == 1 + len(rig.rollers)
    scene = scene.with_(duration=0.01, lead_in=0.0, frame_interval=0.0)
    assert cost(scene).file == pytest.approx(held(recording), rel=1e-9)
    command("fmu", name, "--rpm", scene.motor_rpm, "--step", scene.step)
    assert (tmp_path / "track.fmu").stat().st_size > 1000
