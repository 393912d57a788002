"""Choices of a scene: refusals and their messages, decisions and their reasons, steps."""

import sys

import pandas as pd
import pytest

from tests.conftest import BELT, RIG, refused, run_command
from trackdyn import Rig, Scene, load_rig
from trackdyn.integrate.methods import METHODS
from trackdyn.rig.groove import PROFILES
from trackdyn.rig.laws import NORMAL_LAWS
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.step import halved_steps, round_step
from trackdyn.simulation import simulate as simulation
from trackdyn.sweeps.sweep import requested_rows

TOE = {"idler__toe": 0.5}


@pytest.mark.parametrize(("changes", "fields", "field", "remedy"), [
    ({}, {"friction": "independent"}, "friction = 'independent'", "use 'tangential', or space='spatial'"),
    (TOE, {"space": "planar"}, "space = 'planar'", "idler.toe = 0.5 moves the chain out of its plane"),
    (TOE, {"chain": "single_pin"}, "chain = 'single_pin'", "'double_pin' only"),
    ({}, {"space": "spatial", "closure": "elastic_damping"}, "closure = 'elastic_damping'", "'rigid' only"),
    (TOE, {"integrator": "rk4"}, "integrator = 'rk4'", "'semi_implicit' only"),
    ({}, {"tension": "sprung", "space": "spatial"}, "tension = 'sprung'", "use 'locked'"),
    ({}, {"chain": "belt", "contact_log": False}, "ring_radius = 0.308", "use None"),
    ({}, {"chain": "belt", "ring_radius": None}, "contact_log = True", "contact_log=False"),
    ({}, BELT | {"pitches": (3,)}, "pitches = (3,)", "pitches=()"),
])  # fmt: skip
def test_a_contradiction_is_refused_by_field_with_a_remedy(rig, changes, fields, field, remedy):
    refused(Scene, rig.changed(**changes), 115.0, words=[f"scene: {field}", remedy], **fields)


@pytest.mark.parametrize(
    ("field", "registry", "like"),
    [("normal_law", NORMAL_LAWS, "elastic"), ("tooth_contact", PROFILES, "ten_arcs"), ("integrator", METHODS, "rk4")],
)
def test_an_entry_that_is_added_from_outside_is_a_setting(rig, monkeypatch, field, registry, like):
    monkeypatch.setitem(registry, "mine", registry[like])
    fields = {"step": 1e-5, field: "mine"}
    scene = Scene(rig, 115.0, **fields)
    assert scene.describe()[field] == getattr(scene, field) == "mine" and scene.model is not None
    refused(Scene, rig, 115.0, words=["'mine'; did you mean 'mine'?"], **{field: "min"})
    monkeypatch.undo()
    assert "did you mean" not in refused(Scene, rig, 115.0, **fields)


@pytest.mark.parametrize("wheel", ["sprocket", "idler", "road_wheel"])
@pytest.mark.parametrize(("field", "value"), [("toe", 0.5), ("camber", -0.1), ("axial_offset", 1e-3)])
def test_a_wheel_out_of_the_plane_makes_the_scene_spatial_by_itself(rig, wheel, field, value):
    scene = Scene(rig.changed(**{f"{wheel}__{field}": value}), 115.0)
    space, reason = scene.fidelity["space"]
    assert (scene.space, space, scene.fidelity["friction"].setting) == ("auto", "spatial", "independent")
    assert f"{wheel}.{field} = {value:g}" in reason


def test_a_scene_of_another_rig_follows_it_except_in_its_own_fields():
    first, second = load_rig(RIG), load_rig("parts")
    scene = Scene(first, 115.0, bushing_law="viscous")
    changed = scene.with_(rig=second, duration=3.0)
    assert (changed.drag, changed.tension) == (second.drag, second.tension.kept) != (first.drag, first.tension.kept)
    assert changed.bushing_law == "viscous" != second.bushing.law
    assert scene.with_(tension="sprung").with_(rig=first).tension == "sprung"
    assert scene.with_(rig=first.changed(sprocket__ring="none")).ring_radius is None
    assert scene.with_(ring_radius=0.306).with_(rig=first.changed(sprocket__ring="none")).ring_radius == 0.306


@pytest.mark.parametrize("name", ["paper", "m113"])
@pytest.mark.parametrize("ring", [{}, {"ring_radius": "none"}])
@pytest.mark.parametrize("preset", [{}, {"preset": "fast"}])
def test_scene_command_and_sweep_agree_on_the_step(name, ring, preset, monkeypatch, tmp_path):
    cells = ring | preset
    expected = Scene(load_rig(name), 90.0, **cells | dict.fromkeys(ring)).time_step
    (row,) = requested_rows(pd.DataFrame([cells | {"motor_rpm": 90.0, "rig": name}]))
    assert Scene(Rig.model_validate(row.task["rig"]), **row.task["scene"]).time_step == expected
    scenes = []
    monkeypatch.setattr(simulation, "simulate", lambda scene, **_: scenes.append(scene) or sys.exit(3))
    words = [word for key, value in cells.items() for word in (f"--{key.replace('_', '-')}", value)]
    run_command("simulate", tmp_path / "r.npz", "--rig", name, "--rpm", "90", "-q", *words)
    assert [scene.time_step for scene in scenes] == [expected]


@pytest.mark.parametrize("rate", [1000, 1600, 3200, 44100 // 21])
@pytest.mark.parametrize("limit", [1e-3, 3.3e-4, 1e-4, 7.7e-5, 1e-6])
def test_a_step_divides_the_sample_interval_and_is_within_its_limit(rate, limit):
    steps = halved_steps(limit, 1 / rate, 3)
    for k, step in enumerate(steps):
        assert step <= limit / 2**k * (1 + 1e-9) and (1 / rate) / step == pytest.approx(round(1 / rate / step))
    assert steps[0] == round_step(limit, 1 / rate)


@pytest.mark.parametrize("name", shipped_rigs())
@pytest.mark.parametrize("fields", [{}, {"ring_radius": None}])
def test_the_step_of_a_scene_is_the_one_that_its_model_has(name, fields):
    rig = load_rig(name)
    scene = Scene(rig, 115.0, **fields)
    assert scene.step is None and scene.model.step == scene.time_step
    assert scene.model.stride * scene.time_step == pytest.approx(1 / rig.rate)
    chosen = scene.with_(step=scene.time_step)
    assert chosen.step == chosen.time_step == scene.time_step and chosen.with_(step=None) == scene
    refused(scene.with_, step=1 / rig.rate, motor_rpm=3000.0, match="too large for the")
