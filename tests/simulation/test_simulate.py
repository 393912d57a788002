"""Whole runs: the loop stays closed, the energy balance closes, runs repeat, bad runs leave nothing."""

import re

import numpy as np
import pytest

from tests.conftest import BELT, LAWS, assert_same_arrays, recorded, refused, run_command
from trackdyn import DivergenceError, load_recording, sense, simulate
from trackdyn.measure.metrics import run_metrics
from trackdyn.measure.stopping import without_beginning
from trackdyn.model.arrays import ENERGY_NAMES
from trackdyn.rig.layout import body_lengths
from trackdyn.simulation.energy_balance import energy_residual

GAP = 1.1e-10  # m, printed in the paper (C01)


@pytest.mark.parametrize(
    ("ring", "step", "chain"), [(None, 1e-4, "double_pin"), (0.313, 5e-5, "double_pin"), (0.308, 1e-4, "single_pin")]
)
def test_the_loop_stays_closed_at_every_instant(make_scene, ring, step, chain):
    scene = make_scene(210.0, ring_radius=ring, step=step, chain=chain)
    # `simulate` refuses half a second without ring at this step: RMS is 3 % off
    recording = recorded(scene, frame_interval=0.05)
    assert recording.gap.shape == (500,) and recording.gap.max() <= GAP and recording.gap.min() >= 0
    length, angle = body_lengths(scene.rig, chain), recording.frame[:, 2:-1]
    assert angle.shape[1] == len(length) == scene.bodies
    assert {0, 2} <= set(recording.contact_log["side"]) or ring is None  # the arcs that drive, and the ring
    # angles of 10 rad are stored to 2e-15 rad; 70 of them
    assert np.abs(np.exp(1j * angle) @ length).max() <= GAP


@pytest.mark.parametrize("ring", [None, 0.308])
def test_the_loop_advances_thirteen_pitches_a_turn_and_open_work_halves_with_the_step(make_scene, ring):
    """Work is counted exactly: only the error of the path is left, of order 1, where 0.1 % are asked for."""
    open_work = []
    for step in (1e-4, 5e-5):
        recording = recorded(make_scene(210.0, ring_radius=ring, duration=3.0, step=step), frame_interval=0.5)
        # mean rate of all bodies: one turn a loop revolution; a tooth that is taken or left within 2.5 s is 5 % of one
        turned = np.ptp(recording.frame[[0, -1], 2:-1].mean(axis=1)) / (2 * np.pi)
        assert turned == pytest.approx(2.5 * recording.scene.periods.loop_hz, rel=0.02)
        change = np.diff(recording.energy[[0, -1]], axis=0)[0]
        work = dict(zip(ENERGY_NAMES, change, strict=True))
        assert min(work[name] for name in ("tooth_friction", "wheel_friction", "bearing", "bushing_loss")) > 0
        assert abs(energy_residual(recording)) < 1e-3
        open_work.append(change[0] - change[1:].sum())
    # the next order: the step, 1e-4 s, times the rate at which teeth mesh, 8 1/s, is 8e-4
    assert open_work[0] / open_work[1] == pytest.approx(2.0, rel=2e-3)


STEEL = {"steel__youngs_modulus": 1e19, "tooth_contact__youngs_modulus": 1e19}


@pytest.mark.parametrize(("changes", "fields"), [(STEEL, {}), ({}, {"ring_radius": None, "step": 1e-3})], ids=str)
def test_a_run_that_diverges_names_time_and_place_and_leaves_no_file(
    make_scene, rig, monkeypatch, tmp_path, changes, fields
):
    """With the check of the step out of the way neither a step nor a rig that is absurd ends in a result."""
    monkeypatch.setattr("trackdyn.scene.step.step_limits", lambda *_: {"none": 1.0})
    # without loss: steel that damps itself at the instant of its force would hold the bodies together
    absurd = make_scene(210.0, rig=rig.changed(**changes), normal_law="elastic", **fields)
    ended = r"at t = [\d.e-]+ s of .*, first at (link|connector) \d+"
    refused(simulate, absurd, error=DivergenceError, match=ended)
    if fields:
        words = "--rpm", "210", "-q", "--ring-radius", "none", "--step", "1e-3"
        done = run_command("simulate", tmp_path / "out/run.npz", *words)
        assert done.code == 1 and re.search(ended, done.err) and list(tmp_path.rglob("*.npz*")) == []


def read_back(run, path):
    run.save(path)
    back = load_recording(path)
    assert back.scene == run.scene
    assert_same_arrays(back, run)
    np.testing.assert_equal(run_metrics("", back), run_metrics("", run))
    return back


@pytest.mark.parametrize("fields", [
    {"frame_interval": 0.1, "pitches": (1, 2)}, {"every_link": True}, {"ring_radius": None},
    {"motor_rpm": 0.0, "frame_interval": 0.1, "lead_in": 2.0},  # strands swing by 0.3 % of g until then
    BELT, BELT | {"motor_rpm": 0.0}, {"space": "spatial", **LAWS},
    {"integrator": "linearly_implicit", "step": 2e-4},
], ids=str)  # fmt: skip
def test_a_recording_is_read_back(make_scene, tmp_path, fields):
    run = simulate(make_scene(**fields))
    read_back(run, tmp_path / "run.npz")
    if fields.get("motor_rpm") == 0.0 and "chain" not in fields:  # at rest a sensor shows gravity
        assert np.hypot(sense(run).ay, sense(run).ax) == pytest.approx(1.0, abs=1e-3)
    for seconds in (0.13, 0.35, 0.45):
        shorter = without_beginning(run, seconds)
        if run.scene.chain != "belt":
            assert read_back(shorter, tmp_path / "part.npz").seconds < run.seconds


def test_a_loop_that_is_driven_to_rest_is_measured_there(driven_loop, tmp_path):
    loop = driven_loop()
    loop.drive(0.0, 0.2)
    run = loop.record(0.5, frame_interval=0.1)
    refused(run_metrics, "", run, words=["the motor speed goes from ", "record after the ramp"])
    read_back(loop.record(0.3), tmp_path / "still.npz")
