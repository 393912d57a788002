"""Refusals in one sentence: the field, the value and the accepted values. No kernel is compiled."""

import json
import os
from fractions import Fraction
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
import yaml
from snakemake.utils import update_config

from tests.conftest import BELT, RIG, ROOT, refused, written
from tests.kinematics import unsettled_loop
from trackdyn import Rig, Scene, load_recording, load_rig, read_sensor, simulate
from trackdyn.inputs.errors import shown
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.rig.sections import Wheel
from trackdyn.scene.choices import CHOICES
from trackdyn.simulation.recorder import Recorder
from trackdyn_replication.pipeline.config import RIG_FIELDS, check_config, check_layers, read_layer

HUGE, LONGER = 10**400, 10**5000  # beyond a float; beyond Python's text of integers
NUMBER = "must be a finite number"
NO_NUMBERS = (
    HUGE, LONGER, "115", None, [115], {}, True, 1 + 2j, float("nan"), float("inf"), np.array([1.0, 2.0]), b"1",
)  # fmt: skip

# tables: a statement, then words of the error message; first keys of mappings, and their places in the message
MAPPINGS = [(field.rpartition(".")[2], field) for field in (
    "chain", "wheels", "sensors", "wheels.idler", "wheels.road_wheel", "sensors.sensor",
)]  # fmt: skip
NO_MAPPING = "= None: must be a mapping of names to values"
CHANGES = [
    *[({"gravity": value}, "gravity", NUMBER) for value in NO_NUMBERS if not isinstance(value, dict)],
    *[({name: None}, f"{where} {NO_MAPPING}") for name, where in MAPPINGS],
    ({"profile": 5}, "profile = 5: must be a mapping of names to values, or in Python an instance of ToothProfile"),
    ({"wheels": {}, "idler__x": 1.0}, "idler__x is in a section that another change replaces"),
    ({"gravity": 1e300}, "gravity = 1e+300", "less than or equal to"),
    ({"chain__pitches": 35.5}, "chain.pitches = 35.5", "must be a whole number"),
    ({"chain__pitches": "35"}, "chain.pitches = '35'", NUMBER),
    ({"idler__radius": -0.3}, "wheels.idler.radius = -0.3", "greater than 0"),
    ({"steel__youngs_modulus": 2e-309}, "steel.youngs_modulus = 2e-309", "at least 1e-40"),
    ({"chain__link_length": 0.2}, "chain.link_length = 0.2", "leaves no room for a connector"),
    ({"ring_contact__friction_dynamic": 0.5}, "ring_contact.friction_dynamic = 0.5", "exceeds friction_static"),
    ({"sensor__pitch": 36}, "sensor.pitch = 36", "1 to 35 are"),
    ({"sprocket__ring_radius": 0.33}, "sprocket.ring_radius = 0.33 m", "more than 5% off", "sprocket.ring = none"),
    *[({"tension__wheel": name}, "tension.wheel", "or 'road_wheel'") for name in ("sprocket", np.array(["idler"]))],
]
# values that are allowed one by one and lead nowhere: refused when the scene is made
IMPOSSIBLE = [
    ({"steel__youngs_modulus": 1e19, "tooth_contact__youngs_modulus": 1e19}, "step = 0.0001", "at most"),
    *[({name: value}, "step = 0.0001", "no step of 1e-08 s or more is small enough")
      for name, value in (("gravity", 1e7), ("tension__pre_tension", 1e9), ("chain__link_mass", 1e-39))],
]  # fmt: skip


def entry(value, unit="m/s2", **more):
    return {"value": value, "unit": unit, "kind": "assumed", "source": "a test", **more}


RIG_FILES = [
    *[({"gravity": value}, f"gravity = {value!r} has no unit", "unit: m/s2") for value in ("9.81", None)],
    *[({name: None}, f"{where} {NO_MAPPING}") for name, where in MAPPINGS],
    ({"profile": {"arcs": [[0, 0, 1]]}}, 'unit: "m, m, m, 1", kind'),
    ({"profile": {"arcs": entry([[0.1, 0, 0.05]], "m")}}, "profile.arcs", "it must be given in 'm, m, m, 1'"),
    ({"gravity": entry(True)}, "gravity = True", "a number in m/s2"),
    ({"gravity": entry(float("nan"))}, "gravity = nan", NUMBER),
    ({"gravity": entry(9.81, kind=["printed"])}, "gravity has the kind ['printed']", "printed, derived"),
    ({"gravity": entry(9.81, source=5)}, "gravity has no source"),
    ({"gravity": entry(9.81, low=10, high=1)}, "gravity needs low and high as rising numbers"),
    ({"gravity": entry(9.81, **{"a\nb": 1})}, "unknown key 'a\\nb'"),
    ({"profile": {"arcs": entry([[0, 0, 1]], "m, m, m, 1")}}, "profile.arcs = [[0, 0, 1]]", "4 numbers each"),
    ({"gravity": {}}, "gravity lacks kind, source, unit, value"),
    ({"drag": entry(True, "name")}, "drag = True: input should be 'viscous', "),
    ({"load": entry(3, "kN")}, "load has the unit 'kN'; it must be given in 'N'"),
    ({"load": entry(-3, "N")}, "load = -3", "greater than or equal to 0"),
    ({"gravity": "9.81 m/s2"}, "gravity = '9.81 m/s2' has no source"),
    ({"load": "3 km"}, "load has the unit 'km'; it must be given in 'N'"),
    ({"a\nb": 1}, "'a\\nb' is not a known parameter"),
    ({"chain": {"link_mass": entry(10.0, "kg")}}, "chain.pitches is missing; add it"),
    ({"chain": {"pitchs": entry(35, "1")}}, "chain.pitchs is not a known parameter", "(pitches?)"),
    ({5: 1}, "5", "string"),
]

NO_CHOICES = (
    np.array(["a", "b"]), None, np.timedelta64(1), np.ma.array(["free"], mask=[True]), np.ma.masked, ["free"], b"free",
    LONGER,
)  # fmt: skip
NO_LISTS = ("12", 3, None, LONGER, [1.5], [True], {1, 2}, [[1]], iter([1]))
RINGS = Scene.ring_range(load_rig(RIG))
SCENES = [
    *[({"motor_rpm": value}, "motor_rpm", NUMBER) for value in NO_NUMBERS],
    *[({name: HUGE}, name, NUMBER) for name in ("duration", "lead_in", "ramp", "frame_interval")],
    *[({name: value}, f"{name} = ", NUMBER) for name in ("ring_radius", "step") for value in (HUGE, "long")],
    *[({"load": value}, f"load = {value!r}") for value in (float("nan"), float("inf"), "3 kN", True, None)],
    *[({"load": value}, "load = ", "must be between 0 and 1e+07 N") for value in (-1.0, 1e8)],
    ({"motor_rpm": -1}, "motor_rpm = -1.0", "between 0 and 100000 rev/min"),
    ({"ring_radius": 1e300}, "ring_radius = 1e+300", "between {:.4f} m (touches no link) and {:.4f} m".format(*RINGS)),
    ({"ring_radius": -0.3}, "ring_radius = -0.3", "must be a radius in m, or null"),
    ({"duration": 1e-300}, "duration = 1e-300", "between 0.001 and"),
    ({"lead_in": 1e9}, "lead_in", "and 36000 s"),
    ({"ramp": 5e-324}, "ramp = 5e-324", "between 1e-06 and"),
    ({"step": 1e-12}, "step = 1e-12", "at least 1e-08 s"),
    ({"step": 0.0}, "step = 0.0: must divide", "such as 5e-05"),
    ({"step": 1e-8, "duration": 36000}, "step = 1e-08", "3.6e+12 steps"),
    ({"frame_interval": 1e308}, "frame_interval = 1e+308", "no longer than the duration"),
    ({"frame_interval": -0.1}, "frame_interval = -0.1", "a multiple"),
    *[({"pitches": value}, "pitches", "a list of whole numbers") for value in NO_LISTS],
    *[({"pitches": [value]}, "pitches", "between 1 and 35") for value in (HUGE, 36)],
    *[({"contact_log": value}, "contact_log", "True or False") for value in (1, "yes", None, np.array([True, False]))],
    *[({"chain": value}, "chain = ", ": use ") for value in NO_CHOICES],
    *[({name: None}, f"{name} = None: use ") for name in CHOICES],
    ({"motor_rpm": np.timedelta64(5, "s")}, "motor_rpm", NUMBER),
    ({"motor_rpm": np.ma.array(115.0, mask=True), "chain": "x" * 2000}, "scene: "),
    *[({"rig": value}, "rig", "an instance of Rig") for value in (None, "trackdyn/rigs/paper.yaml", Scene)],
    *[({name: 3}, f"{name} is not a known parameter", "") for name in ("speed", "solver", "joint", "tolerance")],
]
LOOPS = [
    (lambda loop: loop.step(0), "count = 0: must be"), (lambda loop: loop.drive(115, ramp=0), "ramp = 0.0"),
    (lambda loop: loop.advance(float("nan")), "seconds = nan", NUMBER),
    (lambda loop: loop.advance(-1), "seconds = -1", "between 0 and"),
    (lambda loop: loop.record(0), "duration = 0.0", "between 0.001 and"),
    (lambda loop: loop.record(0.1, pitches=[99]), "pitches = 99"),
    (lambda loop: loop.record(0.1, frame_interval=1e-9), "frame_interval = 1e-09"),
    (lambda loop: loop.drive(60000), "step = 5e-05: too large for the turn of the sprocket (motor_rpm)"),
    (lambda loop: loop.shift_tensioner(1), "shift = 1:", "the tensioner's travel"),
    (lambda loop: Rig(chain="x"), "rig: gravity is missing"), (lambda loop: Wheel(x="x"), "wheel: x = 'x'", NUMBER),
]  # fmt: skip
YAML_FILES = [
    *[(content, "must hold sections") for content in (b"", b"- 1\n")],
    (b"a: [1\n", "is not valid YAML at line 2"),
    ("a: \u00b5\n".encode("latin-1"), "cannot be read as UTF-8 text, byte 0xb5 in line 1"),
    ("a: 1\n".encode("utf-16"), "cannot be read as UTF-8"),
    (b"a: &x 1\nb: *x\n", "line 2 holds an alias (*)", "write the value out"),
    (b"a: " + b"[" * 5000, "line 1 is nested more than 20 levels deep"),
    (b"a: 1\nc: {b: 1, b: 2}\n", "line 2 gives 'b' a second time"),
    (b"a: !!python/object/apply:os.system ['touch ran']\n", "is not valid YAML at line 1"),
    *[(content, "is not valid YAML") for content in (b"\0\1\2", b"a: !!python/name:os.system\n", b"a: " + b"9" * 5000)],
    (b"#" * 1_000_001, "is larger than 1 MB"),
]
SETTINGS = [
    *[("results", value, "results = '", "the name of a folder") for value in ("", "x" * 300)],
    *[("results", value, "results = ", "in letters, digits and") for value in ("~/x", "r$(touch$IFS'x')", "x{run}")],
    ("results", "README.md", "README.md is a file"),
    ("results", 5, "valid string"),
    ("records.duration_s", -90, "records.duration_s = -90", "greater than 0"),
    ("ring_study.steps_s", [[0.309, 5e-5], [0.305, 1e-4]], "0.305 comes after 0.309; give rising"),
    ("records.speeds_rpm", [], "records.speeds_rpm", "at least 1 item"),
    ("records", [1, 2], "records = [1, 2]", "a mapping of names to values"),
    ("records.lead_in_s", True, "records.lead_in_s = True"),
    ("sensor_is_synthetic", "yes", "sensor_is_synthetic = 'yes'"),
    ("records.speeds_rpm", [115, 150, 150], "records.speeds_rpm = [115.0, 150.0, 150.0]: 150 occurs twice; give"),
    ("ring_study.radii_m", [0.3080, 0.30801], "ring_study: two runs would share the name ring/115rpm_0.308"),
    ("ring_study.radii_m", [0.303, 0.5], "ring_study (run ring/115rpm_0.5)", "ring_radius = 0.5", "or no ring"),
    ("records.speeds_rpm", [1e9], "records.speeds_rpm.0 = 1000000000.0", "less than 100000"),
    ("records.duration_s", 1e300, "records (run 115rpm): scene: duration = 1e+300", "and 36000 s"),
    ("stop_rule.longest_turns", 10**30, "stop_rule.longest_turns", "less than or equal to 1000000"),
    ("peers.steps_s", [1e-4, 1e-4], "peers: steps_s = [0.0001, 0.0001]", "occurs twice"),
    ("peers.steps_s", [1e-4, 3e-5], "peers: scene: step = 3e-05", "must divide"),
    ("peers.speed_rpm", 9e4, "peers: scene: motor_rpm = 501300.0"),
    ("fidelity.settings", ["preset=best"], "fidelity.settings", "preset=paper"),
    ("sensor_csv", "nowhere/{rpm}.csv", "nowhere/115.csv does not exist"),
    ("sensor_csv", "{0.__class__}", "the only field in braces is {rpm}"),
    ("sensor_csv", "/dev/zero", "it names one file for several speeds; write {rpm} where the motor speed belongs"),
    ("sensor_csv", "d{{x}}/{rpm}.csv", "sensor_csv = 'd{x}/115.csv': holds a brace; rename the file or folder"),
]
MINE, PAPER = Path("mine.yaml"), yaml.safe_load(shipped_rigs()["paper"].read_bytes())


def configured(key, value):
    os.chdir(ROOT)
    data, (*sections, field) = read_yaml("config/config.yaml"), key.split(".")
    reduce(lambda section, name: section.setdefault(name, {}), sections, data)[field] = value
    check_config(data, "mine.yaml")


# function of the rig and a statement, begin of the message, and rows
TABLES = {
    "rig": (lambda rig, changes: rig.changed(**changes), "", CHANGES),
    "impossible rig": (lambda rig, changes: Scene(rig.changed(**changes), 115.0), "", IMPOSSIBLE),
    "rig file": (lambda _, changes: load_rig(written(MINE, yaml.safe_dump(PAPER | changes))), "mine.yaml: ", RIG_FILES),
    "scene": (lambda rig, fields: Scene(**{"rig": rig, "motor_rpm": 115.0} | fields), "scene: ", SCENES),
    "loop": (lambda rig, call: call(unsettled_loop(Scene(rig, 0.0, ring_radius=None))), "", LOOPS),
    "YAML file": (lambda rig, content: load_rig(written(MINE, content)), "mine.yaml: ", YAML_FILES),
    "layer": (lambda rig, content: read_layer(written(MINE, content)), "mine.yaml: ", YAML_FILES),
    "configuration": (lambda rig, setting: configured(*setting), "", [(row[:2], *row[2:]) for row in SETTINGS]),
}
ROWS = [(table, *row) for table, (_, _, rows) in TABLES.items() for row in rows]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}: {row[2] if callable(row[1]) else shown(row[1])[:36]}")
def test_a_row_is_refused(rig, row, tmp_path, monkeypatch):
    table, stated, *words = row
    call, start, _ = TABLES[table]
    monkeypatch.chdir(tmp_path)
    refused(call, rig, stated, words=words, start=start)
    assert not {*os.listdir(tmp_path)} - {"mine.yaml"}  # nothing in a file is run


def test_numbers_of_any_library_are_accepted(rig):
    for value in (150, np.float32(150), np.int64(150), np.array(150.0), np.array(150), Fraction(300, 2)):
        described = Scene(rig, value, **BELT, pitches=()).describe()
        assert json.dumps(described) == json.dumps(Scene(rig, 150.0, **BELT).describe())
    assert type(Scene(rig, 150.0, **BELT | {"chain": np.str_("belt")}).chain) is str
    assert Scene(rig, 115.0, pitches=np.array([1, 2]), contact_log=np.bool_(True)).describe()["pitches"] == [1, 2]


def test_a_recording_that_does_not_fit_into_the_memory_is_refused_before_it_starts(rig, monkeypatch):
    monkeypatch.setattr("trackdyn.simulation.recorder.free_memory", lambda: 1e6)
    words, scene = ("duration = 90 s:", "MB of memory and 1 MB are free", "use at most"), Scene(rig, 115.0)
    refused(simulate, scene, words=words)
    refused(simulate, Scene(rig, 115.0, **BELT), words=words)
    refused(Recorder, unsettled_loop(scene), scene.with_(duration=90.0), words=words)


# as YAML 1.2 has it: 1.1 makes 29, 8, 70, 10.5, 10 and truth values of the first ones, and text of 2e11
@pytest.mark.parametrize(("text", "value"), [
    ("035", 35), ("-010", -10), ("1:10", "1:10"), ("1_0.5", "1_0.5"), ("0x0A", "0x0A"), ("0o17", "0o17"),
    ("yes", "yes"), ("off", "off"), ("2024-01-01", "2024-01-01"), ("2e11", 2e11), ("1.0e9", 1e9), ("-.5e3", -500.0),
    ("5.", 5.0), ("true", True), ("'7'", "7"), ("~", None),
])  # fmt: skip
def test_a_number_is_read_as_written(tmp_path, text, value):
    data = read_yaml(written(tmp_path / "mine.yaml", f"a: {text}\nb: [{text}]\n"))
    assert data == {"a": value, "b": [value]} and type(data["a"]) is type(value)


def test_a_later_file_overrides_an_earlier_one_and_the_command_line_both(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = written(tmp_path / "mine.yaml", "records: {duration_s: 0100, lead_in_s: 2e1}\n")
    config, _, _ = check_layers(["config/config.yaml", path], {"records": {"ramp_s": 0.75}}, update_config)
    assert (config.records.duration_s, config.records.lead_in_s, config.records.ramp_s) == (100, 20.0, 0.75)


@pytest.mark.parametrize("reader", [load_rig, load_recording, read_yaml, read_sensor])
@pytest.mark.parametrize("row", [
    ("/dev/zero", "is a pipe or a device, not a file"), ("/dev/stdin", "a"), (".", "is a folder"),
    ("absent", "no such file"), ("a\0b", "must be the name of"), ("x" * 300, "File name too long"),
    (None, " = None:"), (b"rig.yaml", " = b'rig.yaml':"),
], ids=lambda row: shown(row[0]))  # fmt: skip
def test_a_place_that_holds_no_file_is_refused(tmp_path, monkeypatch, reader, row):
    path, *words = row
    monkeypatch.chdir(tmp_path)
    refused(reader, path, words=words)


def test_files_whose_names_hold_braces_are_refused(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    base, rig = read_yaml(ROOT / "config/config.yaml"), shipped_rigs()["bench"].read_text(encoding="utf-8")
    for name, text in (("a{b}.yaml", rig), ("base}.yaml", rig), ("mine.yaml", "like: base}.yaml\n")):
        written(Path(name), text)
    data = base | RIG_FIELDS | {"article": None, "studies": str(ROOT / base["studies"])}
    data |= {name: base[name] | RIG_FIELDS[name] for name in ("records", "meshing", "ring_study")}
    for name, shortened in (("a{b}.yaml", "a{b}.yaml"), ("mine.yaml", "base}.yaml")):
        refused(check_config, data | {"rig": name}, "mine.yaml", words=[f"rig = '{shortened}': holds a brace"])
    refused(check_layers, ["{x}.yaml"], {}, dict.update, match=r"^--configfile = '\{x\}\.yaml': holds a brace")


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    # root may write anywhere else
    monkeypatch.setattr("trackdyn_replication.pipeline.config.os.access", lambda path, mode: False)
    refused(configured, "results", "mine/new", words=["results = 'mine/new'", "is not writable; choose another folder"])


def test_a_loop_without_weight_and_tension_has_a_step_limit(rig):
    assert Scene(rig.changed(gravity=0, tension__pre_tension=0), 115.0).time_step == 1e-4
