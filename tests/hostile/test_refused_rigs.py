"""A rig that cannot be is refused in one sentence that names the entry, the value and what is accepted."""

import sys

import numpy as np
import pytest
import yaml
from sentences import LONGER, NO_NUMBERS, NUMBER, RIG, one_sentence

from tests.conftest import run_command
from trackdyn.inputs.errors import InputError, shown
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene

# keys of what must be a mapping, and where its sentence says that it is
MAPPINGS = [
    *((name, name) for name in ("chain", "wheels", "sensors")),
    *((name, f"wheels.{name}") for name in ("idler", "road_wheel")),
    ("sensor", "sensors.sensor"),
]
NO_MAPPING = "= None: must be a mapping of names to values"
CHANGES = [
    *[({"gravity": value}, "gravity", NUMBER) for value in NO_NUMBERS if not isinstance(value, dict)],
    *[({name: None}, f"{where} {NO_MAPPING}") for name, where in MAPPINGS],
    ({"profile": 5}, "profile = 5: must be a mapping of names to values, or in Python an instance of ToothProfile"),
    ({"wheels": {}, "idler__x": 1.0}, "idler__x is in a section that another change replaces"),
    ({"gravity": 1e300}, "gravity = 1e+300", "less than or equal to"),
    ({"chain__pitches": 35.5}, "chain.pitches = 35.5", "must be a whole number"),
    ({"idler__radius": -0.3}, "wheels.idler.radius = -0.3", "greater than 0"),
    ({"steel__youngs_modulus": 2e-309}, "steel.youngs_modulus = 2e-309", "at least 1e-40"),
    ({"chain__pitches": "35"}, "chain.pitches = '35'", NUMBER),
    ({"chain__link_length": 0.2}, "chain.link_length = 0.2", "leaves no room for a connector"),
    ({"ring_contact__friction_dynamic": 0.5}, "ring_contact.friction_dynamic = 0.5", "exceeds friction_static"),
    ({"sensor__pitch": 36}, "sensor.pitch = 36", "1 to 35 are"),
    ({"sprocket__ring_radius": 0.33}, "sprocket.ring_radius = 0.33 m", "more than 5% off", "sprocket.ring = none"),
    ({"tension__wheel": "sprocket"}, "tension.wheel = 'sprocket'", "'idler' or 'road_wheel'"),
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
    *[({"gravity": value}, f"gravity = {value!r} has no unit", "unit: m/s2") for value in ("9.81", None)],
    *[({name: None}, f"{where} {NO_MAPPING}") for name, where in MAPPINGS],
    ({"profile": {"arcs": [[0, 0, 1]]}}, 'unit: "m, m, m, 1", kind'),
    ({"gravity": entry(True)}, "gravity = True", "a number in m/s2"),
    ({"gravity": entry(LONGER)}, "not valid YAML"),
    ({"gravity": entry(float("nan"))}, "gravity = nan", NUMBER),
    ({"gravity": entry(9.81, "ft/s2")}, "'ft/s2'", "'m/s2'"),
    ({"gravity": entry(9.81, unit=None)}, "gravity has the unit None"),
    ({"gravity": entry(9.81, kind=["printed"])}, "gravity has the kind ['printed']", "printed, derived"),
    ({"gravity": entry(9.81, source=5)}, "gravity has no source"),
    ({"gravity": entry(9.81, low=10, high=1)}, "gravity needs low and high as rising numbers"),
    ({"gravity": entry(9.81, **{"a\nb": 1})}, "unknown key 'a\\nb'"),
    ({"profile": {"arcs": entry([[0, 0, 1]], "m, m, m, 1")}}, "profile.arcs = [[0, 0, 1]]", "4 numbers each"),
    ({"gravity": {}}, "gravity lacks kind, source, unit, value"),
    ({"drag": entry(True, "name")}, "drag = True: input should be 'viscous', "),
    ({"a\nb": 1}, "'a\\nb' is not a known parameter"),
    ({"chain": {"link_mass": entry(10.0, "kg")}}, "chain.pitches is missing; add it"),
    ({"chain": {"pitchs": entry(35, "1")}}, "chain.pitchs is not a known parameter", "(pitches?)"),
    ({5: 1}, "5", "string"),
]


def rig_file(folder, changes):
    """A file of the rig with other sections, or other values of fields (``section__field``)."""
    limit = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        data = yaml.safe_load(RIG.read_text(encoding="utf-8"))
        for name, value in changes.items():
            section, _, field = str(name).rpartition("__")
            if section:
                data[section][field] |= {"value": value}
            else:
                data[name] = value
        text = yaml.safe_dump(data)
    finally:
        sys.set_int_max_str_digits(limit)
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("row", RIGS, ids=lambda row: shown(row[0]))
def test_a_rig_file_is_refused(tmp_path, row):
    changes, *words = row
    path = rig_file(tmp_path, changes)
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert one_sentence(caught, *words).startswith(f"{path}: ")


PLAIN = [row for row in (*CHANGES, *IMPOSSIBLE) if isinstance(next(iter(row[0].values())), (int, float, str))]


@pytest.mark.parametrize("row", [*RIGS, *PLAIN], ids=lambda row: shown(row[0]))
def test_check_and_simulate_refuse_the_same_rigs(tmp_path, monkeypatch, row):
    monkeypatch.chdir(tmp_path)
    path = rig_file(tmp_path, row[0])
    checked = run_command("check", path, "--no-settle")
    simulated = run_command("simulate", "run.npz", "-q", "--rig", path)
    # the rig is the first argument of the one, an option of the other: only the former names it in every sentence
    assert checked.code == simulated.code == 1
    assert checked.err.replace(f"{path}: ", "") == simulated.err.replace(f"{path}: ", "")
    assert "Traceback" not in checked.err and not (tmp_path / "run.npz").exists()
