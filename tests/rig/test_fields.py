"""Fields of a rig by dotted name, on every included rig."""

import pytest

from tests.conftest import refused
from trackdyn.rig.rig import Rig, load_rig, parameter_table
from trackdyn.rig.rig_file import shipped_rigs


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
        assert rig.value(drag) == section.bearing_drag
        assert rig.changed(**{drag: section.bearing_drag + 1.0}).value(drag) == section.bearing_drag + 1.0


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
        surfaces = {name: rig.wheel_contact.model_dump()}
        words = [f"surfaces.'{name}' is not a valid name: ", " of a section, a wheel"]
        refused(rig.changed, surfaces=surfaces, words=words)


# the rig has a profile in place of a groove
HINTS = {
    "bushing.stifness": "did you mean bushing.stiffness", "road_7.bearing_drag": "did you mean road_",
    "tension": "did you mean tension.", "groove.r1": "did you mean ", "rollers.idler.x": "did you mean idler.x",
    "": "a name such as", "no\nsuch": "a name such as",
}  # fmt: skip


def test_an_unknown_field_is_refused_with_similar_names():
    for name, hint in HINTS.items():
        refused(load_rig("m113").value, name, words=["is not a parameter of the rig", hint])
    names = "idler", "wheels.x", "road_1.arm", "road_1.arm.colour", "Big Wheel.x", "*.x", "x.y.z", ""
    assert not any(map(Rig.may_have, names))
