"""Fields of a rig by dotted name: one way to list, read and set them, on every shipped rig."""

import re

import pytest

from trackdyn.inputs.errors import InputError
from trackdyn.rig.rig import Rig, load_rig, parameter_table
from trackdyn.rig.rig_file import shipped_rigs


@pytest.mark.parametrize("name", shipped_rigs())
def test_fields_are_those_of_the_file_and_can_be_read_and_set(name):
    # a copy was not tried: its steps are none of its values
    rig, table = load_rig(name).changed(), parameter_table(shipped_rigs()[name])
    entries = table[table["kind"] != "derived"].set_index("name")
    for field, unit in entries["unit"].items():
        assert rig.fields[field].unit == unit and Rig.may_have(field), field
    assert all(Rig.may_have(field) for field in rig.fields)
    for field in entries.index:
        value = rig.value(field)
        assert rig.changed(**{field: value}) == rig, field
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


@pytest.mark.parametrize("name", [*Rig.model_fields, "idler", "a.b", "<b>", ""])
def test_a_surface_has_no_name_of_something_else(name):
    """Else `value` and `changed` would act on the surface where a section is meant, or on none."""
    rig = load_rig("m113")
    with pytest.raises(InputError, match=f"surfaces.'{re.escape(name)}' is not a valid name: .* of a section, a wheel"):
        rig.changed(surfaces={name: rig.wheel_contact.model_dump()})


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("bushing.stifness", "did you mean bushing.stiffness"),
        ("road_7.bearing_drag", "did you mean road_"),
        ("tension", "did you mean tension."),
        ("groove.r1", "did you mean "),  # the rig has a profile
        ("rollers.idler.x", "did you mean idler.x"),
        ("", "a name such as"),
        ("no\nsuch", "a name such as"),
    ],
)
def test_what_is_no_field_is_refused_with_what_is_close(name, hint):
    with pytest.raises(InputError, match="is not a parameter of the rig") as refusal:
        load_rig("m113").value(name)
    assert hint in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "name", ["idler", "wheels.x", "road_1.arm", "road_1.arm.colour", "Big Wheel.x", "*.x", "x.y.z", ""]
)
def test_what_no_rig_may_have(name):
    assert not Rig.may_have(name)
