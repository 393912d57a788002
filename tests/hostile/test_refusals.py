"""What a hostile user gives ends in one sentence that names the place, the value and the remedy, and writes nothing.

A row says what is given and which words the sentence must have. No kernel is compiled: the recording that is
damaged here is that of a belt.
"""

import json
import resource
import sys
import zipfile
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import yaml

from trackdyn.commands import cli
from trackdyn.errors import DivergenceError, InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.pipeline.config import check_config, read_layer
from trackdyn.scene.fidelity import CHOICES
from trackdyn.scene.scene import Scene
from trackdyn.simulation import cost as needs
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.checkpoint import read_checkpoint
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn.simulation.simulate import simulate
from trackdyn.study.accuracy.planner import load_trade

ROOT = Path(__file__).parents[2]
RIG = ROOT / "config" / "rig.yaml"
HUGE, LONGER = 10**400, 10**5000  # beyond a float; beyond what Python writes as text
NUMBER = "a finite number is needed"
BELT = {"chain": "belt", "ring_radius": None, "spells": False}


def shown(value):
    """Name of a row."""
    try:
        return repr(value)[:40]
    except ValueError:
        return "10**5000"


def one_sentence(caught, *words):
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 700, sentence
    for word in words:
        assert word in sentence, sentence
    return sentence


# --- scenes ---------------------------------------------------------------------------------------------------------

NO_NUMBERS = (
    HUGE,
    LONGER,
    "115",
    None,
    [115],
    {},
    True,
    1 + 2j,
    float("nan"),
    float("inf"),
    np.array([1.0, 2.0]),
    b"1",
)
NO_CHOICES = (
    np.array(["a", "b"]), None, np.timedelta64(1), np.ma.array(["free"], mask=[True]), np.ma.masked, ["free"], b"free",
    LONGER,
)  # fmt: skip
SCENES = [
    *[({"motor_rpm": value}, "motor_rpm", NUMBER) for value in NO_NUMBERS],
    *[
        ({name: HUGE}, name, NUMBER)
        for name in ("ring_radius", "duration", "lead_in", "ramp", "step", "frame_interval")
    ],
    *[({name: "long"}, f"{name} = 'long'", NUMBER) for name in ("ring_radius", "duration", "step", "tolerance")],
    ({"motor_rpm": -1}, "motor_rpm = -1.0", "at least 0 and at most 100000 rev/min"),
    ({"motor_rpm": 1e300, **BELT}, "motor_rpm = 1e+300", "at most 100000"),
    ({"ring_radius": 1e300}, "ring_radius = 1e+300", "give a radius between, or no ring"),
    ({"ring_radius": -0.3}, "ring_radius = -0.3", "a radius in m would do, or no ring"),
    ({"duration": 1e-300}, "duration = 1e-300", "at least 0.001"),
    ({"duration": 1e9}, "duration", "at most 36000 s"),
    ({"lead_in": 1e9}, "lead_in = 1000000000.0", "at most 36000 s"),
    ({"lead_in": -1}, "lead_in = -1.0", "at least 0"),
    ({"ramp": 1e300}, "ramp = 1e+300", "at most 36000 s"),
    ({"ramp": 5e-324}, "ramp = 5e-324", "at least 1e-06"),
    ({"step": 5e-324}, "step = 5e-324", "a whole fraction of the sample interval"),
    ({"step": 1e-12}, "step = 1e-12", "at least 1e-08 s"),
    ({"step": 1e300}, "step = 1e+300", "a whole fraction"),
    ({"step": 0.0}, "step = 0.0", "such as 5e-05"),
    ({"step": -1e-4}, "step = -0.0001", "a whole fraction"),
    ({"step": 1e6, "integrator": "adaptive", "tolerance": 1e-6}, "step = 1000000.0", "a whole fraction"),
    ({"step": 1e-8, "duration": 36000}, "step = 1e-08", "3.6e+12 steps"),
    ({"frame_interval": 1e308}, "frame_interval = 1e+308", "within the duration"),
    ({"frame_interval": 1e-16}, "frame_interval = 1e-16", "a multiple of the sample interval"),
    ({"frame_interval": -0.1}, "frame_interval = -0.1", "a multiple"),
    ({"integrator": "adaptive", "tolerance": 1e-16}, "tolerance = 1e-16", "at least 1e-12"),
    ({"integrator": "adaptive", "tolerance": 5e-324}, "tolerance = 5e-324", "at least 1e-12"),
    ({"integrator": "adaptive", "tolerance": 1e300}, "tolerance = 1e+300", "at most 0.5"),
    ({"integrator": "adaptive"}, "tolerance = None", "use 1e-6"),
    *[
        ({"pitches": value}, "pitches", "a list of whole numbers")
        for value in ("12", 3, None, LONGER, [1.5], [True], {1, 2}, [[1]], iter([1]))
    ],
    ({"pitches": [HUGE]}, "pitches", "exist"),
    ({"pitches": [0]}, "pitches = 0", "1 to 35 exist"),
    ({"pitches": [36]}, "pitches = 36", "1 to 35 exist"),
    *[({"spells": value}, "spells", "True or False") for value in (1, "yes", None, b"1", np.array([True, False]))],
    *[({name: value}, f"{name} = ", "is not accepted: use ") for name in CHOICES for value in NO_CHOICES],
    ({"integrator": HUGE}, "integrator", "semi_implicit"),
    ({"motor_rpm": np.timedelta64(5, "s")}, "motor_rpm", NUMBER),
    ({"duration": np.timedelta64(5, "s")}, "duration", NUMBER),
    ({"chain": "x" * 2000}, "chain = 'xxx", "double_pin"),
    ({"integrator": np.ma.masked_array([1, 2], mask=[0, 1])}, "integrator", "semi_implicit"),
    ({"motor_rpm": np.ma.array(115.0, mask=True), "solver": "x" * 2000}, "scene: "),
    ({"rig": None}, "rig = None", "dictionary"),
    ({"rig": "config/rig.yaml"}, "rig = 'config/rig.yaml'", "dictionary"),
    ({"rig": Scene}, "rig", "dictionary"),
    ({"speed": 3}, "speed is not a known parameter", "spelling"),
]


@pytest.mark.parametrize("row", SCENES, ids=lambda row: shown(row[0]))
def test_a_scene_is_refused(rig, row):
    fields, *words = row
    with pytest.raises(InputError) as caught:
        Scene(**{"rig": rig, "motor_rpm": 115.0} | fields)
    assert one_sentence(caught, *words).startswith("scene: ")


@pytest.mark.parametrize(
    "value", [150, np.float32(150), np.int64(150), np.array(150.0), np.array(150), Fraction(300, 2)], ids=shown
)
def test_a_number_is_a_number_whichever_library_it_comes_from(rig, value):
    """The same scene, the same bytes of its description."""
    described = Scene(rig, value, **BELT, pitches=()).describe()
    assert json.dumps(described) == json.dumps(Scene(rig, 150.0, **BELT).describe())
    assert type(Scene(rig, 150.0, **BELT | {"chain": np.str_("belt")}).chain) is str
    assert Scene(rig, 115.0, pitches=np.array([1, 2]), spells=np.bool_(True)).describe()["pitches"] == [1, 2]


# --- rigs -----------------------------------------------------------------------------------------------------------

CHANGES = [
    *[({"gravity": value}, "gravity", NUMBER) for value in NO_NUMBERS if not isinstance(value, dict)],
    ({"gravity": -1}, "gravity = -1", "greater than or equal to 0"),
    ({"gravity": 1e300}, "gravity = 1e+300", "less than or equal to"),
    ({"gravity__x": 1}, "'gravity.x' is not a parameter"),
    ({"chain": 5}, "chain = 5", "dictionary"),
    ({"chain__pitches": 10**8}, "chain.pitches = 100000000", "20000"),
    ({"chain__pitches": 35.5}, "chain.pitches = 35.5", "a whole number is needed"),
    ({"chain__pitches": HUGE}, "chain.pitches", NUMBER),
    ({"chain__link_mass": 0}, "chain.link_mass = 0", "greater than 0"),
    ({"chain__link_length": 1e20}, "chain.link_length = 1e+20", "1000"),
    ({"sprocket__teeth": 200}, "sprocket.teeth = 200", "127"),
    ({"sensor__rate": 1e300}, "sensor.rate = ", "less than or equal to"),
    ({"sensor__rate": 10**12}, "sensor.rate = 1000000000000", "less than or equal to 100000000"),
    ({"sensor__rate": 0.5}, "sensor.rate = 0.5", "a whole number"),
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
    ({"gravity": 1e7}, "step = 0.0001", "no step of 1e-08 s or more would do"),
    ({"tension__pre_tension": 1e9}, "step = 0.0001", "no step of 1e-08 s or more would do"),
    ({"steel__youngs_modulus": 1e19, "tooth_contact__youngs_modulus": 1e19}, "step = 0.0001", "at most"),
    ({"chain__link_mass": 1e-300}, "step = 0.0001", "no step of 1e-08 s or more would do"),
]


@pytest.mark.parametrize("row", IMPOSSIBLE, ids=lambda row: shown(row[0]))
def test_an_impossible_rig_is_refused_with_its_scene(rig, row):
    changes, *words = row
    with pytest.raises(InputError) as caught:
        Scene(rig.changed(**changes), 115.0)
    one_sentence(caught, *words)


def test_a_loop_without_weight_and_tension_has_a_step_limit(rig):
    """Its contacts carry nothing, and a stiffness of nothing was divided by."""
    assert Scene(rig.changed(gravity=0, tension__pre_tension=0), 115.0).step == 1e-4


def entry(value, unit="m/s2", **more):
    return {"value": value, "unit": unit, "kind": "assumed", "source": "a test", **more}


RIGS = [
    *[
        ({"gravity": value}, f"gravity = {value!r} has no unit", "unit: m/s2")
        for value in (9.81, "9.81", True, None, [1])
    ],
    ({"gravity": entry(True)}, "gravity is True", "a number in m/s2"),
    ({"gravity": entry("fast")}, "gravity is 'fast'", "a number in m/s2"),
    ({"gravity": entry(None)}, "gravity = None", NUMBER),
    ({"gravity": entry([1])}, "gravity = [1]", NUMBER),
    ({"gravity": entry(HUGE)}, "gravity", NUMBER),
    ({"gravity": entry(LONGER)}, "not valid YAML"),
    ({"gravity": entry(float("nan"))}, "gravity = nan", NUMBER),
    ({"gravity": entry(9.81, "ft/s2")}, "'ft/s2'", "'m/s2'"),
    ({"gravity": entry(9.81, unit=None)}, "gravity has the unit None"),
    ({"gravity": entry(9.81, kind="guessed")}, "'guessed'", "printed, derived"),
    ({"gravity": entry(9.81, kind=["printed"])}, "gravity has the kind ['printed']"),
    ({"gravity": entry(9.81, source=5)}, "gravity has no source"),
    ({"gravity": entry(9.81, low=10, high=1)}, "gravity needs low and high as rising numbers"),
    ({"gravity": entry(9.81, **{"a\nb": 1})}, "unknown key 'a\\nb'"),
    ({"gravity": {}}, "gravity lacks kind, source, unit, value"),
    ({"chain": None}, "chain = None", "dictionary"),
    ({"a\nb": 1}, "'a\\nb' is not a known parameter"),
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


FILES = [
    (b"", "holds no sections"),
    (b"- 1\n", "holds no sections"),
    (b"a: [1\n", "is not valid YAML at line 2"),
    ("a: \u00b5\n".encode("latin-1"), "cannot be read as UTF-8 text, byte 0xb5 in line 1"),
    ("a: 1\n".encode("utf-16"), "cannot be read as UTF-8"),
    (b"\0\1\2", "is not valid YAML"),
    (b"a: &x [*x]\n", "line 1 holds an alias (*)"),
    (b"a: &x 1\nb: *x\n", "line 2 holds an alias (*)", "write the value out"),
    (b"a: " + b"[" * 5000, "line 1 is nested more than 20 deep"),
    (b"a: 1\nb: 2\na: 3\n", "line 3 gives 'a' a second time"),
    (b"a: {b: 1, b: 2}\n", "line 1 gives 'b' a second time"),
    (b"a: !!python/object/apply:os.system ['touch ran']\n", "is not valid YAML at line 1"),
    (b"a: !!python/name:os.system\n", "is not valid YAML"),
    (b"a: 2024-99-99\n", "is not valid YAML"),
    (b"a: " + b"9" * 5000, "is not valid YAML"),
    (b"#" * 1_000_001, "is larger than 1 MB"),
]


@pytest.mark.parametrize("row", FILES, ids=lambda row: shown(row[0]))
def test_a_yaml_file_is_refused(tmp_path, monkeypatch, row):
    content, *words = row
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_bytes(content)
    for read in (read_layer, load_rig):
        with pytest.raises(InputError) as caught:
            read(Path("mine.yaml"))
        assert one_sentence(caught, *words).startswith("mine.yaml: ")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]


def test_a_template_is_refused_before_it_is_run(tmp_path):
    """Snakemake's own loader would run it."""
    path = tmp_path / "mine.yaml"
    path.write_text("__use_yte__: true\n?if True:\n  results: x\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"^mine\.yaml: __use_yte__ is not a known parameter"):
        read_layer(path)


PLACES = [
    ("/dev/zero", "no plain file but a pipe or a device"),
    ("/dev/stdin", "a"),
    (".", "is a folder"),
    ("absent", "no such file"),
    ("a\0b", "is not accepted"),
    ("x" * 300, "File name too long"),
    (None, "path = None is not accepted"),
    (b"rig.yaml", "path = b'rig.yaml' is not accepted"),
]


@pytest.mark.parametrize("reader", [load_rig, load_recording, Loop.load, load_trade, read_yaml])
@pytest.mark.parametrize("row", PLACES, ids=lambda row: shown(row[0]))
def test_a_place_that_holds_no_file_is_refused(tmp_path, monkeypatch, reader, row):
    place, *words = row
    if reader is load_trade and place in (None, "/dev/stdin"):
        pytest.skip("None stands for the pipeline's own results")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        reader(place)
    one_sentence(caught, *words)


# --- configurations -------------------------------------------------------------------------------------------------

SETTINGS = [
    ("results", "", "results = ''", "the name of a folder"),
    ("results", "~/x", "results = '~/x'", "without blanks, braces and ~"),
    ("results", "a b", "results = 'a b'"),
    ("results", "x{run}", "results = 'x{run}'"),
    ("results", "README.md", "README.md is a file"),
    ("results", "README.md/x", "README.md is a file"),
    ("results", "x" * 300, "the name of a folder"),
    ("results", 5, "valid string"),
    ("records.speeds_rpm", [HUGE], "records.speeds_rpm.0"),
    ("records.speeds_rpm", [1e9], "records.speeds_rpm.0 = 1000000000.0", "less than 100000"),
    ("records.duration_s", HUGE, "records.duration_s"),
    ("records.duration_s", 1e300, "records (run 115rpm): scene: duration = 1e+300", "at most 36000 s"),
    ("records.lead_in_s", 1e9, "lead_in = 1000000000.0", "at most 36000 s"),
    ("records.step_s", 5e-324, "step = 5e-324"),
    ("records.frame_interval_s", 1e308, "frame_interval = 1e+308"),
    ("known.longest_turns", 10**30, "ring_study"),
    ("ring_study.without_ring", 5, "ring_study.without_ring = 5"),
    ("peers.steps_s", [1e-4, 1e-4], "peers: steps_s = [0.0001, 0.0001]", "stands twice"),
    ("peers.steps_s", [1e-4, 3e-5], "peers: scene: step = 3e-05", "a whole fraction"),
    ("peers.readings", ["motor", "motor"], "peers: readings", "stands twice"),
    ("peers.readings", ["wheel"], "peers.readings.0 = 'wheel'", "'sprocket' or 'motor'"),
    ("peers.duration_s", 1e9, "peers: scene: duration", "at most 36000 s"),
    ("peers.speed_rpm", 9e4, "peers: scene: motor_rpm = 501300.0"),
    ("fidelity.speeds_rpm", [210, 115], "fidelity.speeds_rpm", "give rising values"),
    ("fidelity.settings", ["preset=best"], "fidelity.settings", "preset=paper"),
    ("sensitivity.radii_m", [0.5], "sensitivity.radii_m = [0.5]", "no target of the fit"),
    ("sensor_csv", "nowhere/{rpm}.csv", "nowhere/115.csv does not exist"),
    ("sensor_csv", "{0.__class__}", "the only field in braces may be {rpm}"),
    ("sensor_csv", "/dev/zero", "it names one file for several speeds"),
    ("rig", "/dev/zero", "no plain file"),
    ("rig", "absent.yaml", "absent.yaml: no such file"),
    ("studies", "absent.yaml", "absent.yaml: no such file"),
    ("other_rigs", {"../x": {"rig": "config/rig.yaml", "steps_s": [[210, 1e-4]]}}, "other_rigs", "pattern"),
]


@pytest.mark.parametrize("row", SETTINGS, ids=lambda row: f"{row[0]}={shown(row[1])}")
def test_a_configuration_is_refused_before_anything_runs(monkeypatch, row):
    place, value, *words = row
    monkeypatch.chdir(ROOT)
    data = read_yaml("config/config.yaml")
    *sections, field = place.split(".")
    part = data
    for name in sections:
        part = part[name]
    part[field] = value
    with pytest.raises(InputError) as caught:
        check_config(data, "mine.yaml")
    one_sentence(caught, *words)


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    data = read_yaml("config/config.yaml") | {"results": "mine/new"}
    monkeypatch.setattr("trackdyn.pipeline.config.os.access", lambda place, mode: False)  # root may write anywhere else
    with pytest.raises(InputError) as caught:
        check_config(data, "mine.yaml")
    one_sentence(caught, "results = 'mine/new'", "cannot be written; another place would do")


# --- the command ----------------------------------------------------------------------------------------------------

COMMANDS = [
    ("", "Missing command"),
    ("--nope", "No such option: --nope"),
    ("nope", "No such command 'nope'"),
    ("simulate", "Missing argument"),
    ("simulate run.npz more.npz", "unexpected extra argument"),
    ("simulate run.npz --rpm", "--rpm"),
    ("simulate run.npz --rpm fast", "--rpm = 'fast' is not accepted: a finite number would do"),
    ("simulate run.npz --rpm nan", "--rpm = 'nan' is not accepted"),
    ("simulate run.npz --rpm 1e999", "--rpm = '1e999' is not accepted"),
    ("simulate run.npz --duration 1e9", "at most 36000 s"),
    ("simulate run.npz --lead-in 1e9", "lead_in = 1000000000.0"),
    ("simulate run.npz --step 1e-300", "step = 1e-300"),
    ("simulate run.npz --step x", "--step = 'x' is not accepted"),
    ("simulate run.npz --frame-interval 1e308", "frame_interval = 1e+308"),
    ("simulate run.npz --ring-radius big", "--ring-radius = 'big' is not accepted: a radius in m or the word none"),
    ("simulate run.npz --ring-radius inf", "--ring-radius = 'inf' is not accepted"),
    ("simulate run.npz --preset best", "preset = 'best'", "standard"),
    ("simulate run.npz --choose chain", "--choose = 'chain' is not accepted: name=setting"),
    ("simulate run.npz --choose chain=rope", "chain = 'rope'", "double_pin"),
    ("simulate run.npz --choose integrator=adaptive --choose tolerance=small", "tolerance = 'small'", "1e-6"),
    ("simulate run.npz --choose integrator=adaptive --choose tolerance=1e-6 --step 1e6 -q", "step = 1000000.0"),
    ("simulate run.npz --choose chain=belt --rpm 1e300", "motor_rpm = 1e+300"),
    ("simulate run.npz --tolerance much", "--tolerance = 'much' is not accepted: a share"),
    ("simulate run.npz --tolerance 1% --measure speed", "--measure = 'speed' is not accepted: rms, sd"),
    ("simulate run.npz --tolerance 1% --longest 1e-3", "longest = 0.001 s is not accepted"),
    ("simulate run.npz --measure rms", "--measure is not accepted without --tolerance"),
    ("simulate run.npz --tolerance 1% --checkpoint kept", "--checkpoint is not accepted with --tolerance"),
    ("simulate run.npz --speed 115", "No such option: --speed, --rpm may be meant; see trackdyn simulate --help"),
    ("simulate run.npz --setp 1e-4", "--step may be meant"),
    ("simulate run.csv", "OUT = 'run.csv' is not accepted: a name that ends in .npz"),
    ("simulate /proc/run.npz", "/proc/run.npz: cannot be written"),
    ("simulate plain/run.npz", "plain/run.npz: cannot be written (Not a directory)"),
    ("simulate folder.npz", "folder.npz: cannot be written (Is a directory)"),
    (f"simulate {'x' * 300}.npz", "cannot be written (File name too long)"),
    ("simulate run.npz --checkpoint /proc/state", "/proc/state: cannot be written"),
    ("simulate run.npz --rig /dev/zero", "/dev/zero: is no plain file"),
    ("simulate run.npz --rig plain", "plain: holds no sections"),
    ("compare plain plain", "plain: is not a trackdyn recording, or is damaged"),
    ("compare absent.npz plain", "absent.npz: no such file"),
    ("compare short.npz plain", "plain: no column for ay", "--axis ay=NAME"),
    ("plan --tolerance 2%", "trade.csv: no measured data"),
    ("plan --tolerance 2 --data trade.csv", "tolerance = '2' is not accepted: a share"),
    ("plan --tolerance 2% --data plain", "plain: lacks the column scene"),
    ("plan --tolerance 2% --data empty", "empty: No columns to parse"),
    ("plan --tolerance 2% --data binary", "binary: cannot be read as UTF-8"),
    ("plan --tolerance 2% --data /dev/zero", "/dev/zero: is no plain file"),
    ("plan --tolerance 2% --data .", ".: is a folder"),
    ("plan --tolerance much --data trade.csv", "tolerance = 'much' is not accepted: a share"),
    ("plan --tolerance 2% --measure speed --data trade.csv", "measure = 'speed' is not accepted"),
    ("plan --tolerance 2% --rpm nan --data trade.csv", "--rpm = 'nan'"),
    ("plan --tolerance 2% --data words.csv", "words.csv: Unable to parse string"),
    ("plan --tolerance 2% --data other.csv", "other.csv: names the unknown fidelity 'guess'"),
]
TRADE = (
    "scene,fidelity,integrator,step_s,start_cpu_s,cpu_s_per_s,record_s,passage_s,"
    "measure,value,value_error,error,uncertainty,scatter,unused,failed\n"
)


@pytest.fixture(scope="module")
def belt_file(rig, tmp_path_factory):
    """A recording of half a second without any force."""
    path = tmp_path_factory.mktemp("belt") / "short.npz"
    belt_recording(Scene(rig, 115.0, **BELT, duration=0.5)).save(path)
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch, belt_file):
    """A working directory with what commands may be given."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").symlink_to(ROOT / "config")
    (tmp_path / "folder.npz").mkdir()
    (tmp_path / "short.npz").write_bytes(belt_file.read_bytes())
    for name, content in (
        ("plain", b"text\n"),
        ("empty", b""),
        ("binary", bytes(range(256))),
        (
            "trade.csv",
            TRADE.encode()
            + b"ring 0.308 m 115 rpm,ten_arcs,semi_implicit,1e-4,1,1,4,0.2,rms,1,0.001,0.001,0,0,0,False\n",
        ),
        (
            "words.csv",
            TRADE.encode()
            + b"ring 0.308 m 115 rpm,ten_arcs,semi_implicit,soon,1,1,4,0.2,rms,1,0.001,0.001,0,0,0,False\n",
        ),
        (
            "other.csv",
            TRADE.encode() + b"ring 0.308 m 115 rpm,guess,semi_implicit,1e-4,1,1,4,0.2,rms,1,0.001,0.001,0,0,0,False\n",
        ),
    ):
        (tmp_path / name).write_bytes(content)
    return tmp_path


def run_command(monkeypatch, *arguments):
    """Exit code of the command, run within this process."""
    monkeypatch.setattr(sys, "argv", ["trackdyn", *arguments])
    try:
        cli.main()
    except SystemExit as end:
        return end.code
    return 0


@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row[0][:60])
def test_a_command_ends_with_one_line_and_code_1(folder, monkeypatch, capsys, row):
    line, *words = row
    before = sorted(folder.rglob("*"))
    assert run_command(monkeypatch, *line.split()) == 1
    out, err = capsys.readouterr()
    assert err.startswith("trackdyn: ") and len(err.splitlines()) == 1, err
    for word in words:
        assert word in err
    assert out == "" and sorted(folder.rglob("*")) == before


def test_a_command_that_is_right_ends_with_code_0(folder, monkeypatch, capsys):
    """The plan that the rows above are refused for, and a belt from start to end: what it needs stands at the top."""
    assert run_command(monkeypatch, "plan", "--tolerance", "2%", "--data", "trade.csv") == 0
    assert run_command(monkeypatch, "simulate", "belt.npz", "--choose", "chain=belt", "--frame-interval", "0") == 0
    out = capsys.readouterr().out
    assert "needs  about" in out and "rms_g" in out and (folder / "belt.npz").exists()


def test_an_interruption_is_one_line(folder, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["trackdyn.simulation.simulate"], "simulate", stop)
    assert run_command(monkeypatch, "simulate", "run.npz", "-q") == 130
    assert capsys.readouterr().err.strip() == "trackdyn: interrupted; no file is left half-written"


# --- a loop that runs -----------------------------------------------------------------------------------------------

CALLS = [
    (lambda loop: loop.step(0), "count = 0 is not accepted: at least 1"),
    (lambda loop: loop.step("ten"), "count = 'ten'", NUMBER),
    (lambda loop: loop.advance(float("nan")), "seconds = nan", NUMBER),
    (lambda loop: loop.advance(-1), "seconds = -1", "at least 0"),
    (lambda loop: loop.advance(1e300), "seconds = 1e+300", "at most 36000"),
    (lambda loop: loop.record(0), "duration = 0.0", "at least 0.001"),
    (lambda loop: loop.record(1e9), "duration = 1000000000.0", "at most 36000"),
    (lambda loop: loop.record(0.1, pitches=[99]), "pitches = 99"),
    (lambda loop: loop.record(0.1, frame_interval=1e-9), "frame_interval = 1e-09"),
    (lambda loop: loop.drive("fast"), "motor_rpm = 'fast'", NUMBER),
    (lambda loop: loop.drive(115, ramp=0), "ramp = 0.0"),
    (lambda loop: loop.shift_tensioner(1), "shift = 1 is not accepted", "the tensioner's travel, would do"),
    (lambda loop: loop.shift_tensioner(None), "shift = None", NUMBER),
    (lambda loop: loop.save("/proc/state"), "/proc/state: cannot be written"),
]


@pytest.mark.parametrize("row", CALLS, ids=lambda row: row[1][:40])
def test_a_call_of_a_loop_is_refused(rig, row):
    """Of a free loop that has taken no step: nothing is compiled."""
    call, *words = row
    loop = Loop(Scene(rig, 0.0, loop="free", ring_radius=None))
    with pytest.raises(InputError) as caught:
        call(loop)
    one_sentence(caught, *words)


# --- what does not fit ----------------------------------------------------------------------------------------------


def test_a_recording_that_does_not_fit_into_the_memory_is_refused_before_it_starts(rig, monkeypatch):
    """Each of the ways to ask for one: by scene, as a belt, of a loop that runs."""
    monkeypatch.setattr(needs, "virtual_memory", lambda: type("Memory", (), {"available": 1e6}))
    monkeypatch.setattr(sys.modules["trackdyn.simulation.simulate"], "Loop", None)  # it must not come so far
    words = "duration = 90 s is not accepted", "MB of memory and 1 MB are free", "would do"
    for fields in ({}, BELT):
        with pytest.raises(InputError) as caught:
            simulate(Scene(rig, 115.0, **fields))
        one_sentence(caught, *words)
    loop = type("Loop", (), {"scene": Scene(rig, 115.0)})
    with pytest.raises(InputError) as caught:
        Recorder(loop, 90.0, (), 0.0, True, False)
    one_sentence(caught, *words)


def test_a_full_disk_names_the_file_and_leaves_what_was_there(folder, belt_file, monkeypatch):
    """Whether that is found before the run or while the file is written."""
    recording = load_recording(belt_file)
    old = Path("short.npz").read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = sorted(folder.rglob("*"))
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(InputError) as caught:
            recording.save("short.npz")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    one_sentence(caught, "short.npz: cannot be written (File too large)", "free space")
    assert Path("short.npz").read_bytes() == old and sorted(folder.rglob("*")) == before
    monkeypatch.setattr("trackdyn.files.disk_usage", lambda place: type("Usage", (), {"free": 1000}))
    assert run_command(monkeypatch, "simulate", "run.npz") == 1
    assert sorted(folder.rglob("*")) == before


# --- recordings -----------------------------------------------------------------------------------------------------


def described(change):
    """A change of the description of a recording."""

    def apply(arrays):
        meta = json.loads(str(arrays["meta"]))
        change(meta)
        arrays["meta"] = np.array(json.dumps(meta))

    return apply


def changed(name, value):
    return lambda arrays: arrays.update({name: value(arrays[name]) if callable(value) else value})


def spoiled(array):
    array = array.copy()
    array.flat[3] = np.nan
    return array


DAMAGES = [
    ("no array", lambda arrays: arrays.pop("gap"), "gap"),
    ("no description", lambda arrays: arrays.pop("meta"), "is damaged"),
    ("empty description", changed("meta", np.array("")), "is damaged"),
    ("a list as description", changed("meta", np.array("[1]")), "is damaged"),
    ("nested description", changed("meta", np.array("[" * 100_000)), "is damaged"),
    ("a number as description", changed("meta", np.arange(3.0)), "is damaged"),
    ("short array", changed("gap", lambda a: a[:-1]), "gap has float64 of the shape (499,)"),
    ("wide array", changed("mean", lambda a: np.hstack([a, a])), "mean has float64 of the shape (500, 6)"),
    ("flat array", changed("raw", np.ravel), "raw has float64 of the shape (1500,)"),
    ("text", changed("time", lambda a: a.astype(str)), "time has <U"),
    ("complex", changed("time", lambda a: a + 1j), "time has complex128"),
    ("not a number", changed("mean", spoiled), "mean holds a value that is not a finite number"),
    ("begin as list", changed("begin", np.zeros(2)), "begin has"),
    ("pickled", changed("time", np.array([{}], dtype=object)), "is damaged"),
    ("another format", described(lambda meta: meta.update(format=2)), "has recording format 2, this version reads"),
    ("format as text", described(lambda meta: meta.update(format="a\nb")), "has recording format 'a\\nb'"),
    ("no rig", described(lambda meta: meta.pop("rig")), "rig"),
    ("half a rig", described(lambda meta: meta["rig"].pop("sensor")), "sensor"),
    ("rig as list", described(lambda meta: meta.update(rig=[1])), "is damaged"),
    ("no scene", described(lambda meta: meta.pop("scene")), "scene"),
    ("a field of the scene", described(lambda meta: meta["scene"].update(speed=1)), "speed is not a known parameter"),
    ("speed as text", described(lambda meta: meta["scene"].update(motor_rpm="fast")), "motor_rpm = 'fast'"),
    ("another fidelity", described(lambda meta: meta["fidelity"].update(chain={"setting": "rope"})), "fidelity"),
    ("layout as text", described(lambda meta: meta.update(layout={"path_m": "far"})), "is damaged"),
    ("versions as list", described(lambda meta: meta.update(versions=[1])), "versions"),
]


ROWS = ("time", "raw", "mean", "gap", "cut", "change", "place", "wheel_rate", "energy", "force", "area", "groove")


def kept(part):
    """Some of the samples of every array."""
    return lambda arrays: arrays.update({name: arrays[name][part] for name in ROWS})


DAMAGES += [
    ("time reversed", changed("time", lambda a: a[::-1]), "time is not that of 1000 Hz"),
    ("time zero", changed("time", lambda a: 0 * a), "time is not that of 1000 Hz"),
    ("time doubled", changed("time", lambda a: 2 * a), "time is not that of 1000 Hz"),
    ("half of the samples", kept(slice(None, None, 2)), "250 samples are not the duration of the scene"),
    ("the first half", kept(slice(250)), "250 samples are not the duration of the scene"),
    ("no sample", kept(slice(0)), "0 samples are not the duration of the scene"),
    ("another duration", described(lambda m: m["scene"].update(duration=5.0)), "500 samples are not the duration"),
    ("another rate", described(lambda m: m["rig"]["sensor"].update(rate=500)), "500 samples are not the duration"),
    ("before the start", changed("begin", np.array(-5.0)), "begin = -5.0 is before the start"),
    ("too large", changed("raw", lambda a: a + 1e300), "raw holds a value beyond 1e+12"),
    ("a wheel more", changed("wheel_rate", lambda a: np.hstack([a, a])), "wheel_rate is not of the wheels"),
    ("pitches of a belt", lambda a: a.update(
        pitches=np.array([1]), area=np.zeros((500, 1, 2), int), groove=np.zeros((500, 1, 2), int),
        force=np.zeros((500, 1, 3))), "pitches are not those of the scene"),
    ("frames of a belt", lambda a: a.update(frame=np.zeros((2, 73)), frame_time=np.zeros(2)), "frame is not one"),
    ("a plane of a belt", changed("plane", np.zeros((500, 8))), "plane is not that of the scene"),
    ("links of a belt", changed("link_mean", np.zeros((500, 35, 3))), "link_mean is not of every link"),
    ("a spell before the record", changed("spells", np.zeros((1, 11))), "spells are not within the record"),
    ("spells of other pitches", changed("spells", np.full((1, 11), 99.0)), "spells have pitches other than"),
]  # fmt: skip


@pytest.mark.parametrize("row", DAMAGES, ids=lambda row: row[0])
def test_a_damaged_recording_is_refused(tmp_path, belt_file, row):
    _, damage, word = row
    with np.load(belt_file) as data:
        arrays = dict(data)
    damage(arrays)
    path = tmp_path / "run.npz"
    np.savez(path, **arrays)
    with pytest.raises(InputError) as caught:
        load_recording(path)
    assert one_sentence(caught, word).startswith(f"{path}: ")


def test_the_recording_that_was_not_damaged_is_read(belt_file):
    recording = load_recording(belt_file)
    assert recording.fault() is None and recording.checked() is recording


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_recording_that_was_cut_off_is_refused(tmp_path, belt_file, share):
    path = tmp_path / "run.npz"
    path.write_bytes((content := belt_file.read_bytes())[: int(share * len(content))])
    with pytest.raises(InputError) as caught:
        load_recording(path)
    one_sentence(caught, "is not a trackdyn recording, or is damaged")


def test_a_small_file_that_unpacks_to_more_than_the_memory_is_refused(tmp_path, belt_file, monkeypatch):
    with np.load(belt_file) as data:
        arrays = dict(data)
    path = tmp_path / "run.npz"
    np.savez_compressed(path, **arrays | {"mean": np.zeros((1_000_000, 3))})
    monkeypatch.setattr("trackdyn.simulation.recording.virtual_memory", lambda: type("Memory", (), {"available": 4e6}))
    with pytest.raises(InputError) as caught:
        load_recording(path)
    one_sentence(caught, "takes 24 MB of memory, more than the 2 MB")
    monkeypatch.undo()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.npy", b" " * 20_000_000)
    with pytest.raises(InputError, match="is damaged"):
        load_recording(path)


def test_a_number_that_is_not_finite_never_leaves_a_run(belt_file):
    recording = load_recording(belt_file)
    arrays = {name: getattr(recording, name) for name in Recording.ARRAYS}
    broken = Recording(**arrays | {"mean": spoiled(recording.mean)}, meta=recording.meta)
    with pytest.raises(DivergenceError) as caught:
        broken.checked()
    one_sentence(caught, "mean holds a value that is not a finite number", "a smaller step")


@pytest.mark.parametrize(
    "change", [{}, {"parts": 1}, {"parts": {"scene": {}}}, {"parts": {"scene": 5, "layout": {}, "model": {}}}], ids=str
)
def test_a_damaged_checkpoint_is_refused(tmp_path, monkeypatch, change):
    monkeypatch.setattr("trackdyn.simulation.checkpoint.source_hash", lambda: "here")
    path = tmp_path / "state"
    with path.open("wb") as file:
        np.savez(file, meta=np.array(json.dumps({"sources": "here"} | change)), **{"state.pin": np.zeros(4)})
    for read in (Loop.load, lambda name: simulate(Scene(load_rig(RIG), 115.0), checkpoint=name)):
        with pytest.raises(InputError) as caught:
            read(path)
        one_sentence(caught, "is not a checkpoint, or is damaged; remove it to start anew")
    assert path.exists()


def test_a_checkpoint_of_other_sources_says_so(tmp_path):
    path = tmp_path / "state"
    with path.open("wb") as file:
        np.savez(file, meta=np.array(json.dumps({"sources": "a\nb", "parts": {}})))
    with pytest.raises(InputError) as caught:
        read_checkpoint(path)
    one_sentence(caught, "remove it to start anew")
