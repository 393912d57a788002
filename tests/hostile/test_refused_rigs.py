"""A rig that cannot be is refused in one sentence that names the entry, the value and what is accepted."""

import sys

import numpy as np
import pytest
import yaml
from sentences import LONGER, NO_NUMBERS, NUMBER, RIG, one_sentence

from trackdyn.errors import InputError, shown
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene

CHANGES = [
    *[({"gravity": value}, "gravity", NUMBER) for value in NO_NUMBERS if not isinstance(value, dict)],
    ({"gravity": -1}, "gravity = -1", "greater than or equal to 0"),
    ({"gravity": 1e300}, "gravity = 1e+300", "less than or equal to"),
    *[
        ({name: None}, f"{path} = None: must be a mapping of names to values")
        for name, path in (
            ("chain", "chain"),
            ("wheels", "wheels"),
            ("idler", "wheels.idler"),
            ("road_wheel", "wheels.road_wheel"),
            ("sensor", "sensors.sensor"),
            ("surfaces", "surfaces"),
        )
    ],
    ({"profile": 5}, "profile = 5: must be a mapping of names to values, or in Python an instance of ToothProfile"),
    ({"chain__pitches": 10**8}, "chain.pitches = 100000000", "20000"),
    ({"chain__pitches": 35.5}, "chain.pitches = 35.5", "must be a whole number"),
    ({"chain__link_mass": 0}, "chain.link_mass = 0", "greater than 0"),
    ({"steel__youngs_modulus": 2e-309}, "steel.youngs_modulus = 2e-309", "at least 1e-40"),
    ({"chain__link_length": 1e20}, "chain.link_length = 1e+20", "1000"),
    ({"sprocket__teeth": 200}, "sprocket.teeth = 200", "127"),
    ({"sensor__rate": 1e300}, "sensor.rate = ", "less than or equal to"),
    ({"sensor__rate": 0.5}, "sensor.rate = 0.5", "a whole number"),
    *[
        ({f"{section}__{name}": value}, f"{section}.{name} = {value!r}")
        for section, name, value in (
            ("chain", "link_mass", -10.0),
            ("chain", "connector_inertia", 0),
            ("chain", "pitches", "35"),
            ("chain", "link_length", 0.2),
            ("sprocket", "teeth", 4),
            ("bushing", "damping", -1.0),
            ("tooth_contact", "restitution", 1.2),
            ("tooth_contact", "poisson_ratio", 0.5),
            ("ring_contact", "transition_velocity", 0.0),
            ("ring_contact", "friction_dynamic", 0.5),
            ("tension", "wheel", "sprocket"),
            ("sensor", "pitch", 36),
            ("groove", "r2", 0.018),
            ("groove", "r5", 0.02),
        )
    ],
    ({"tension__wheel": 3}, "tension.wheel = 3", "'idler' or 'road_wheel'"),
    ({"tension__wheel": np.array(["idler"])}, "tension.wheel", "'idler' or 'road_wheel'"),
]


@pytest.mark.parametrize("row", CHANGES, ids=lambda row: shown(row[0]))
def test_a_change_of_the_rig_is_refused(rig, row):
    changes, *words = row
    with pytest.raises(InputError) as caught:
        rig.changed(**changes)
    one_sentence(caught, *words)


# values that are allowed one by one and lead nowhere: refused when the scene is made
IMPOSSIBLE = [
    ({"gravity": 1e7}, "step = 0.0001", "no step of 1e-08 s or more is small enough"),
    ({"tension__pre_tension": 1e9}, "step = 0.0001", "no step of 1e-08 s or more is small enough"),
    ({"steel__youngs_modulus": 1e19, "tooth_contact__youngs_modulus": 1e19}, "step = 0.0001", "at most"),
    ({"chain__link_mass": 1e-39}, "step = 0.0001", "no step of 1e-08 s or more is small enough"),
]


@pytest.mark.parametrize("row", IMPOSSIBLE, ids=lambda row: shown(row[0]))
def test_an_impossible_rig_is_refused_with_its_scene(rig, row):
    changes, *words = row
    with pytest.raises(InputError) as caught:
        Scene(rig.changed(**changes), 115.0)
    one_sentence(caught, *words)


def test_a_loop_without_weight_and_tension_has_a_step_limit(rig):
    """Its contacts carry nothing, and a stiffness of nothing was divided by."""
    assert Scene(rig.changed(gravity=0, tension__pre_tension=0), 115.0).time_step == 1e-4


def entry(value, unit="m/s2", **more):
    return {"value": value, "unit": unit, "kind": "assumed", "source": "a test", **more}


RIGS = [
    *[
        ({"gravity": value}, f"gravity = {value!r} has no unit", "unit: m/s2")
        for value in (9.81, "9.81", True, None, [1])
    ],
    ({"profile": {"arcs": [[0, 0, 1]]}}, 'unit: "m, m, m, 1", kind'),
    ({"gravity": entry(True)}, "gravity = True", "a number in m/s2"),
    ({"gravity": entry("fast")}, "gravity = 'fast'", "a number in m/s2"),
    ({"gravity": entry(LONGER)}, "not valid YAML"),
    ({"gravity": entry(float("nan"))}, "gravity = nan", NUMBER),
    ({"gravity": entry(9.81, "ft/s2")}, "'ft/s2'", "'m/s2'"),
    ({"gravity": entry(9.81, unit=None)}, "gravity has the unit None"),
    ({"gravity": entry(9.81, kind="guessed")}, "'guessed'", "printed, derived"),
    ({"gravity": entry(9.81, kind=["printed"])}, "gravity has the kind ['printed']"),
    ({"gravity": entry(9.81, source=5)}, "gravity has no source"),
    ({"gravity": entry(9.81, low=10, high=1)}, "gravity needs low and high as rising numbers"),
    ({"gravity": entry(9.81, **{"a\nb": 1})}, "unknown key 'a\\nb'"),
    (
        {"profile": {"arcs": entry([[0, 0, 1], [1, 1, 1]], "m, m, m, 1")}},
        "profile.arcs = [[0, 0, 1], [1, 1, 1]]",
        "4 numbers each",
    ),
    ({"gravity": {}}, "gravity lacks kind, source, unit, value"),
    *[
        ({name: None}, f"{path} = None: must be a mapping of names to values")
        for name, path in (
            ("chain", "chain"),
            ("wheels", "wheels"),
            ("idler", "wheels.idler"),
            ("sensor", "sensors.sensor"),
        )
    ],
    ({"a\nb": 1}, "'a\\nb' is not a known parameter"),
    ({"chain": {"link_wieght": entry(10.0, "kg")}}, "chain.link_wieght is not a known parameter"),
    ({"chain": {"link_mass": entry(10.0, "kg")}}, "chain.pitches is missing; add it"),
    ({5: 1}, "5", "string"),
]


@pytest.mark.parametrize("row", RIGS, ids=lambda row: shown(row[0]))
def test_a_rig_file_is_refused(tmp_path, row):
    changes, *words = row
    limit = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        text = yaml.safe_dump(yaml.safe_load(RIG.read_text(encoding="utf-8")) | changes)
    finally:
        sys.set_int_max_str_digits(limit)
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert one_sentence(caught, *words).startswith(f"{path}: ")
