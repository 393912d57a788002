"""Answers of equal error in both codes: what is measured, and what is chosen."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from replication.peers.answers import _answers, compare_answers, measured_accelerations, ours
from replication.peers.comparison import run_peer
from replication.peers.contact import make_contacts, peer_contact_loads
from replication.peers.exudyn_loop import drive_at, fixed, free_wheels
from replication.report.answers import answers_outcome
from replication.study.settings import PEER_LAWS, PeerAnswers
from tests.conftest import contact_table
from trackdyn.errors import InputError
from trackdyn.measure.spectra import high_frequency_rms
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate


def test_accelerations_of_a_known_motion_are_averaged_by_passage():
    """Links on circles of 1 m at 2 rad/s have 4 m/s2 each, whatever their phase; second differences see it to (w T)^2 /
    12.
    """
    time, phases = np.arange(1001) / 1000, np.linspace(0, 6, 35)
    angle = 2 * time[:, None] + phases
    measured = measured_accelerations(np.stack([np.cos(angle), np.sin(angle)], axis=2), 1000.0, 0.2)
    assert list(measured.passage) == [0, 1, 2, 3]
    assert measured.estimate().value == pytest.approx(4.0, rel=1e-6)


def test_our_links_move_as_the_loop_says(rig):
    """Places from recorded configurations beside those of a loop that is stepped."""
    scene = Scene(rig, 115.0, 0.308, duration=0.02, lead_in=0.01, ramp=0.1, contact_log=False, **PEER_LAWS)
    centre, _, _ = ours(scene)
    loop = Loop(scene)
    loop.advance(0.13)
    np.testing.assert_allclose(centre[-1], loop.mass_centres[::2], atol=1e-12)


def test_the_cheapest_setting_that_keeps_the_tolerance_is_chosen():
    """Made-up runs: errors of the step of 0.4 and 4 %, scatter of 1 % a passage, which nine of them bring below 1 %."""
    noise = 0.02 * np.random.default_rng(1).standard_normal(40)

    def run(method, step):
        size = np.repeat(np.sqrt(1 + noise), 25)[:, None] * (1 + 40 * step)
        turn = np.cumsum(np.ones(1000)) * 0.5
        return (
            np.cumsum(
                np.cumsum(np.stack([size * np.cos(turn)[:, None], size * np.sin(turn)[:, None]], axis=2), axis=0),
                axis=0,
            ),
            0.1,
            1e-4 / step,
        )

    asked = SimpleNamespace(tolerance=0.01, ramp_s=1.0, lead_in_s=0.5)
    settings = [("semi_implicit", step) for step in (1e-5, 2e-5, 1e-4, 1e-3)]
    rows = pd.DataFrame(_answers("ours", settings, "semi_implicit", asked, 0.025, 1000.0, run)).set_index("step_s")
    assert rows.loc[1e-4, "difference_pct"] == pytest.approx(0.4, abs=0.01) and rows.loc[1e-4, "chosen"] == "yes"
    assert rows.loc[1e-3, "difference_pct"] == pytest.approx(4.0, abs=0.1) and np.isnan(rows.loc[1e-3, "cpu_s"])
    assert rows["chosen"].eq("yes").sum() == 1
    assert "exudyn does not reach it" in answers_outcome(
        pd.concat([rows.assign(code="trackdyn"), pd.DataFrame([{"code": "exudyn"}])]), 0.01
    )
    assert rows.loc[1e-4, "cpu_s"] == pytest.approx(0.1 + 1.0 * (1.5 + 0.025 * rows.loc[1e-4, "passages"]))


def test_without_the_other_code_our_side_stands_alone(rig, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "exudyn", None)
    asked = PeerAnswers(
        speed_rpm=210, ring_radius_m=0.308, tolerance=0.05, ramp_s=0.1, lead_in_s=0.05, passages=9,
        steps_s={"semi_implicit": [1e-4, 5e-5]}, exudyn_steps_s=[1e-3, 5e-4],
    )  # fmt: skip
    table = compare_answers(rig, asked)
    assert list(table["code"]) == ["trackdyn", "trackdyn", "exudyn"]
    assert table["note"].iloc[2] == "not run: exudyn is not installed; in the clone: pip install -e '.[peers]'"
    assert "exudyn does not reach it with these settings or was not run" in answers_outcome(table, 0.05)
    assert table["rms_m_s2"][0] == pytest.approx(table["rms_m_s2"][1], rel=0.02)


def test_a_loop_that_the_other_code_has_not_is_refused_with_one_that_it_has(rig):
    """What the refusal advises exists."""
    with pytest.raises(
        InputError, match=r"exudyn_loop\.fixed with chain = double_pin, tension = locked, .* bushing_law = viscous"
    ):
        run_peer(Scene(rig, 115.0, tension="sprung", duration=0.01, contact_log=False, **PEER_LAWS), 5e-4)
    scene = Scene(fixed(rig), 115.0, chain="double_pin", tension="locked", space="planar", **PEER_LAWS)
    assert free_wheels(scene, scene.model).drag == tuple(wheel.bearing_drag for wheel in rig.rollers.values())


@pytest.mark.parametrize("other", [{"drag": "rolling"}, {"drag": "coulomb"}, {"bushing_law": "hysteretic"}])
def test_a_law_that_the_other_code_has_not_is_refused(rig, other):
    """It was left out unsaid."""
    scene = Scene(rig, 115.0, **PEER_LAWS | other)
    with pytest.raises(InputError, match="viscous drag and bushings"):
        free_wheels(scene, scene.model)


@pytest.mark.peer
def test_accelerations_of_all_links_and_peaks_of_tooth_forces_are_those_of_the_other_code(rig):
    """RMS and SD within 0.05 %, content from 20 Hz on within 0.1 %, largest normal force of the left arc of every
    connector that passes the sprocket within 0.5 %: both steps leave out less than half of that.
    """
    pytest.importorskip("exudyn")
    scene = Scene(rig, 210.0, 0.308, step=2e-5, ramp=0.3, lead_in=0.2, duration=0.6, **PEER_LAWS)
    loop, rate, begin = Loop(scene), rig.sensor.rate, scene.ramp + scene.lead_in
    contacts, drive, chain = make_contacts(scene, loop.layout["tensioner_shift_m"]), loop.model.drive, loop.model.chain
    smooth = contacts.law.copy()
    smooth[:, 2:4] = 0.0  # friction
    normal = contacts._replace(law=smooth)
    start, n = float(loop.state.wheel_angle[0]), len(chain.length)
    load, torque, most = np.zeros((n, 3)), np.zeros((n, len(contacts.circle))), np.zeros(n // 2)

    def watch(time, places, rates, memory):
        if time > begin:
            turned, spin = drive_at(drive, time)
            peer_contact_loads(normal, chain.length, places, rates, start + turned, spin, memory, False, load, torque)
            np.maximum(most, np.hypot(load[1::2, 0], load[1::2, 1]), out=most)

    def measured(places):
        acceleration = np.diff(places, 2, axis=0)[..., 1] * rate**2
        high = [high_frequency_rms(of_link, rate) for of_link in acceleration.T]
        return np.sqrt(np.mean(acceleration**2)), acceleration.std(), np.sqrt(np.mean(np.square(high)))

    run, _ = run_peer(scene.with_(lead_in=0.0, duration=scene.lead_in + scene.duration), 1e-4, watch=watch)
    peer, known = measured(run.centre[round(begin * rate) + 1 :, ::2]), measured(ours(scene)[0])
    assert peer[:2] == pytest.approx(known[:2], rel=5e-4)
    assert peer[2] == pytest.approx(known[2], rel=1e-3)
    table = contact_table(simulate(scene))
    assert "right" not in set(table["side"])  # or the force of a connector is that of both arcs
    known = table[table["side"] == "left"].groupby("connector")["peak_n"].max()
    assert len(known) >= 3
    assert most[known.index - 1] == pytest.approx(known.to_numpy(), rel=5e-3)
