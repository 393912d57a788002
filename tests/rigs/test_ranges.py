"""Fields of a rig by dotted name, and their ranges: rigs have their values within them, or list those outside."""

import numpy as np
import pytest

from tests.conftest import refused, written
from trackdyn import Loop, Rig, Scene, load_rig
from trackdyn.rig.rig import outside_ranges, parameter_table
from trackdyn.rig.rig_file import shipped_rigs


def test_every_value_that_is_fitted_has_a_range():
    table = parameter_table("parts")
    fitted = table[table["kind"] == "fitted"]
    assert len(fitted) > 10 and fitted[["low", "high"]].notna().all(axis=None)


def test_drag_of_every_law_is_a_lever_that_rubber_has_times_the_load():
    """The viscous and the constant drag are those of rolling resistance at 115 rpm, wheel by wheel."""
    loop = Loop(Scene(load_rig("parts"), 115.0, step=1e-4))
    loop.advance(1.5)
    samples = []
    for _ in range(200):
        loop.step(50)
        samples.append([loop.work.carried[1:].copy(), np.abs(loop.state.wheel_rate[1:])])
    load, rate = np.mean(samples, axis=0)
    low, high = parameter_table("parts").set_index("name").loc["idler.rolling_arm", ["low", "high"]]
    for wheel, force, turning in zip(loop.scene.rig.wheels.values(), load, rate, strict=True):
        for arm in (wheel.rolling_arm, wheel.bearing_drag * turning / force, wheel.bearing_torque / force):
            assert low <= arm <= high


def test_the_head_of_a_rig_lists_the_values_that_no_part_can_have():
    outside = parameter_table("paper").set_index("name")["outside"]
    head = shipped_rigs()["paper"].read_text(encoding="utf-8").partition("gravity:")[0]
    assert all(name in head for name in outside.index[outside != ""])
    assert not any(map(outside_ranges, ("bench", "m113", "parts", "robot", "vehicle")))


# directions belong to the wheels, sizes to one chain, materials to all chains
@pytest.mark.parametrize(("text", "starts"), {
    "ring_contact: {source: x, friction_static: 0.023, friction_dynamic: 0.021}":
        ["ring_contact.friction_static = 0.023 lies below its range, 0.3 to 0.9", "ring_contact.friction_dynamic"],
    "bushing: {source: x, damping: 990 N m s/rad}": ["bushing.damping = 990 N m s/rad lies above its range"],
    "tension: {source: x, direction: 0.0 deg}": [], "chain: {source: x, link_length: 0.05 m, link_mass: 2.0 kg}": [],
    "chain: {source: x, link_length: 0.09 m}\ntooth_contact: {source: x, friction_static: 0.5}":
        ["tooth_contact.friction_static = 0.5 lies above its range, 0.05 to 0.35"],
    "guide: {source: x, clearance: {value: 0.03, unit: m, kind: printed, low: 0, high: 0.1, source: x}}": [],
}.items())  # fmt: skip
def test_values_outside_the_range_that_they_inherit_are_listed(tmp_path, text, starts):
    text = f"like: bench\n{text}\n"
    for name in "abcdefg":  # each like the one before
        sentences = outside_ranges(written(tmp_path / f"{name}.yaml", text))
        assert len(sentences) == len(starts) and all(map(str.startswith, sentences, starts))
        text = f"like: {name}.yaml\n"


@pytest.mark.parametrize("name", shipped_rigs())
def test_fields_are_those_of_the_file_and_can_be_read_and_set(name):
    # a copy has no tried steps
    rig, table = load_rig(name).changed(), parameter_table(shipped_rigs()[name])
    for field, unit in table[table["kind"] != "derived"].set_index("name")["unit"].items():
        assert rig.fields[field].unit == unit, field
        assert rig.changed(**{field: rig.value(field)}) == rig, field
    assert all(map(Rig.may_have, rig.fields))
    for wheel, section in rig.wheels.items():
        drag = f"{wheel}.bearing_drag"
        assert rig.changed(**{drag: section.bearing_drag + 1.0}).value(drag) == rig.value(drag) + 1.0


def test_a_wheel_and_a_surface_are_sections_by_their_names():
    rig = load_rig("m113")
    assert rig.changed(road_3__arm__stiffness=3e4).wheels["road_3"].arm.stiffness == 3e4
    assert rig.changed(road_3__arm=None).wheels["road_3"].suspension is None
    steel = rig.wheel_contact.model_dump()
    rig = rig.changed(surfaces={"bare": steel}, idler__surface="bare")
    assert rig.changed(bare__restitution=0.25).value("bare.restitution") == 0.25
    assert rig.value("wheel_contact.restitution") == steel["restitution"]


def test_a_surface_has_no_name_of_something_else():
    rig = load_rig("m113")
    for name in (*Rig.model_fields, "idler", "a.b", "<b>", ""):
        words = [f"surfaces.'{name}' is not a valid name: ", " of a section, a wheel"]
        refused(rig.changed, surfaces={name: rig.wheel_contact.model_dump()}, words=words)


def test_an_unknown_field_is_refused_with_similar_names():
    # the rig has a profile in place of a groove
    for name, hint in {
        "bushing.stifness": "did you mean bushing.stiffness", "road_7.bearing_drag": "did you mean road_",
        "tension": "did you mean tension.", "groove.r1": "did you mean ", "rollers.idler.x": "did you mean idler.x",
        "": "a name such as", "no\nsuch": "a name such as",
    }.items():  # fmt: skip
        refused(load_rig("m113").value, name, words=["is not a parameter of the rig", hint])
    names = "idler", "wheels.x", "road_1.arm", "road_1.arm.colour", "Big Wheel.x", "*.x", "x.y.z", ""
    assert not any(map(Rig.may_have, names))
