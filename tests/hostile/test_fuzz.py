"""Random damage to a user's input: success or one sentence, never anything else."""

import copy
import importlib
import json
import shutil
import warnings
from unittest.mock import Mock

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tests.conftest import ROOT, run_command, written
from trackdyn import Scene, TrackdynError, load_recording, load_rig, read_sensor
from trackdyn.rig.rig_file import SHIPPED
from trackdyn_replication.pipeline.config import check_config, read_layer

RIG = SHIPPED / "paper.yaml"
# the same examples in every run, and no search for a smaller failure, which has no bound
FUZZ = settings(
    max_examples=30, derandomize=True, deadline=None, database=None, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip

SENSOR = "# made up\nt_s,ax_g,ay_g,az_g\n" + "".join(f"{k / 1000:.3f},0.0,{k % 7 / 7:.4f},0.0\n" for k in range(200))

anything = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 300), st.integers(), st.floats(), st.text(max_size=8),
    st.binary(max_size=3),
    st.sampled_from([0, 1e-300, 1e308, 10**400, "2e11", "auto", "rk4", "none", "spatial", "sprung"]),
    st.lists(st.one_of(st.integers(-2, 40), st.floats(), st.text(max_size=3)), max_size=3),
    st.dictionaries(st.one_of(st.text(max_size=4), st.sampled_from(["value", "unit"])), st.floats(), max_size=2),
)  # fmt: skip


def ends_well(function, *arguments, **keywords):
    """Call a function; None if it is refused in one sentence, and any other exception is the test's."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            return function(*arguments, **keywords)
        except TrackdynError as error:
            assert str(error) and "\n" not in str(error) and len(str(error)) < 1000, str(error)


@st.composite
def damaged(draw, data):
    data = copy.deepcopy(data)
    for _ in range(draw(st.integers(1, 3))):
        section = data
        while True:
            key = draw(st.sampled_from(sorted(section, key=str)))
            deeper = isinstance(section[key], dict) and section[key]
            if not deeper or draw(st.integers(0, 3)) == 0:
                break
            section = section[key]
        action = draw(st.sampled_from(["replace", "replace", "replace", "remove", "add"]))
        if action == "replace":
            section[key] = draw(anything)
        elif action == "remove" and len(section) > 1:
            del section[key]
        else:
            section[draw(st.one_of(st.text(max_size=5), st.integers()))] = draw(anything)
    return data


@st.composite
def mangled(draw, content):
    content = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        at, length = draw(st.integers(0, max(len(content) - 1, 0))), draw(st.sampled_from([1, 2, 8, 100]))
        odd = st.sampled_from([b"\n", b",", b"- ", b"nan", b"1e999", b"&a [*a]", b"\xff\xfe", b"{[" * 30])
        piece = draw(st.one_of(st.binary(max_size=4), odd))
        changes = (len(piece), piece), (length, b""), (0, content[at : at + length]), (len(content), piece)
        replaced, new = draw(st.sampled_from(changes))
        content[at : at + replaced] = new
    return bytes(content)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, belt_file):
    folder = tmp_path_factory.mktemp("fuzz")
    shutil.copy(RIG, folder / "rig.yaml")
    shutil.copy(belt_file, folder / "belt.npz")
    written(folder / "sensor.csv", SENSOR)
    return folder


@FUZZ
@given(fields=st.dictionaries(st.sampled_from(sorted(set(Scene.model_fields) - {"rig"})), anything, max_size=3))
def test_scenes(rig, fields):
    ends_well(Scene, **{"rig": rig, "motor_rpm": 115.0} | fields)


@FUZZ
@given(data=damaged(load_rig(RIG).model_dump()))
def test_rigs_from_python(rig, data):
    changed = ends_well(lambda: rig.changed(**{name: data[name] for name in data if isinstance(name, str)}))
    if changed is not None:
        ends_well(Scene, changed, 115.0)


@FUZZ
@given(data=damaged(yaml.safe_load(RIG.read_bytes())))
def test_rigs_from_files(folder, data):
    path = folder / "mine.yaml"
    try:
        text = yaml.safe_dump(data, allow_unicode=True)
    except (yaml.YAMLError, TypeError):  # a key that cannot be sorted
        return
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    ends_well(load_rig, path)


@FUZZ
@given(data=damaged(yaml.safe_load((ROOT / "config/config.yaml").read_bytes())))
def test_configurations(monkeypatch, data):
    monkeypatch.chdir(ROOT)
    ends_well(check_config, data, "mine.yaml")


@pytest.mark.parametrize(("name", "readers"), [
    ("rig.yaml", (load_rig, read_layer)), ("sensor.csv", (read_sensor,)), ("belt.npz", (load_recording,)),
])  # fmt: skip
@FUZZ
@given(damage=st.data())
def test_bytes_of_files(folder, name, readers, damage):
    path = written(folder / f"mine{name[-5:]}", damage.draw(mangled((folder / name).read_bytes()[:4000])))
    for read in readers:
        ends_well(read, path)


@FUZZ
@given(seed=st.integers(0, 10**6), changes=st.data())
def test_recordings(folder, seed, changes):
    path = folder / "mine.npz"
    arrays = dict(np.load(folder / "belt.npz"))
    meta = json.loads(str(arrays["meta"]))
    name = changes.draw(st.sampled_from(sorted(set(arrays) - {"meta"})))
    arrays[name] = [arrays[name].T, arrays[name][..., None], np.float32(3), np.arange(4)][seed % 4]
    if seed % 2:
        meta = changes.draw(damaged(meta))
    try:
        np.savez(path, **arrays | {"meta": np.array(json.dumps(meta, default=str))})
    except (TypeError, ValueError, UnicodeEncodeError):  # JSON or NumPy cannot write it
        return
    ends_well(load_recording, path)


WORDS = (
    "simulate", "compare", "--rpm", "--step", "--choose", "chain=belt", "chain=rope", "tolerance=1",
    "--tolerance", "2%", "--measure", "left_peak", "--ring-radius", "none", "0.308", "--duration", "1e999", "-1",
    "-q", "--quiet", "--rig", "trackdyn/rigs/paper.yaml", "belt.npz", "x.csv", "--preset", "fast", "--help",
    "--out", ".", "--measure", "rms",
)  # fmt: skip
words = st.one_of(st.sampled_from(WORDS), st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=6))


@FUZZ
@given(arguments=st.lists(words, max_size=8))
def test_commands(folder, monkeypatch, arguments):
    monkeypatch.chdir(folder)
    accepted = Mock(side_effect=TrackdynError("accepted"))
    monkeypatch.setattr(importlib.import_module("trackdyn.simulation.simulate"), "simulate", accepted)
    assert run_command(*arguments).code in (0, 1)
