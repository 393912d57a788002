"""The interface: names, types, help, completion, tables of a notebook."""

import inspect
import pydoc
import re

import pytest
from pydantic import BaseModel

import trackdyn
from tests.conftest import BELT, ROOT, run_python, written
from trackdyn import Rig, Scene, load_rig, sense
from trackdyn.simulation.belt import belt_recording

SCENE = Scene(load_rig("paper"), 115.0)


@pytest.mark.parametrize("owner", [Rig, Scene, SCENE, SCENE.rig, SCENE.rig.chain], ids=lambda of: type(of).__name__)
def test_completion_offers_no_names_of_pydantic(owner):
    offered = {name for name in dir(owner) if not name.startswith("_")}
    assert offered & set(dir(BaseModel)) == {"model_copy"} and len(offered) > 1
    if not isinstance(owner, type):
        assert {*type(owner).model_fields} < offered


@pytest.mark.parametrize("owner", [Rig, Scene, trackdyn.SensorMapping, trackdyn.plan])
def test_a_help_has_types_and_defaults_and_no_machinery(owner):
    text = pydoc.plain(pydoc.render_doc(owner))
    assert not re.search(r"<function|<factory>|lambda|Annotated|FieldInfo|Validator\(|PydanticUndefined", text)


def test_the_signature_of_a_scene_has_its_fields():
    parameters, first = inspect.signature(Scene).parameters, ["rig", "motor_rpm", "ring_radius"]
    assert [*parameters] == [*first, "preset", *(name for name in Scene.model_fields if name not in first)]
    for name, parameter in parameters.items():
        if name != "preset" and parameter.default not in (inspect.Parameter.empty, "of the rig"):
            assert getattr(SCENE, name) == parameter.default
    assert {parameters[name].default for name in ("chain", "drag", "tension")} == {"of the rig"}


def test_a_notebook_shows_tables_and_draws_into_given_axes(pyplot):
    recording = belt_recording(Scene(load_rig("paper"), 115.0, **BELT, duration=4.0))
    signal, rows = sense(recording), "4000 samples at 1000 Hz"
    for shown, words in ((SCENE, "115 rev/min"), (recording, f"4 s, {rows}"), (signal, "ay_g")):
        text = shown._repr_html_()
        assert words in text and text.count("<table") == 1 and "<Rig" not in text and len(text) < 20_000
    assert re.fullmatch(rf"<SensorSignal: {rows}; ax \S+ g RMS, ay \S+ g RMS; 0 clipped>", repr(signal))
    _, ax = pyplot.subplots()
    assert signal.plot(ax=ax) is ax and len(ax.lines) == 2


@pytest.mark.parametrize("words", ["trackdyn simulate run.npz --rig be", "trackdyn ring be"])
def test_a_shell_completes_rigs(words):
    environment = {"_TRACKDYN_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": len(words.split()) - 1}
    done = run_python("-m", "trackdyn", **environment)
    assert done.out.split() == ["bench"], done.err


SCRIPT = """
import numpy as np

from trackdyn import Loop, Recording, Rig, Scene, SensorMapping, load_recording, load_rig, read_sensor, sense, simulate

rig: Rig = load_rig("paper")
scene: Scene = Scene(rig, motor_rpm=115, duration=20.0).with_(ramp=0.5)
recording: Recording = simulate(scene)
recording.save("run.npz")
ay: np.ndarray = sense(load_recording("run.npz"), every=2).ay
step: float = scene.time_step
pitches: tuple[int, ...] = scene.pitches
teeth: int = rig.sprocket.teeth
energy: dict[str, float] = Loop(scene).energy
measured: np.ndarray = read_sensor("logger.csv", SensorMapping(unit="g")).ay
"""
WRONG = (
    'from trackdyn import Scen', 'load_rig(3)', 'simulate(rig)', 'Scene(scene, motor_rpm=115)',
    'text: str = scene.time_step', 'name: str = rig.sprocket.teeth', 'sense(recording, every="2")',
    'signal: float = sense(recording)', 'energies: float = Loop(scene).energy', 'recording.rates',
    'read_sensor("logger.csv", 3)', 'text: str = read_sensor("logger.csv").ay',
)  # fmt: skip


def test_a_users_script_is_checked_against_the_package(tmp_path, monkeypatch):
    api = pytest.importorskip("mypy.api")
    assert (ROOT / "trackdyn" / "py.typed").is_file()
    monkeypatch.setenv("MYPYPATH", str(ROOT))
    options = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(ROOT / ".mypy_cache"), "--no-pretty"]
    report, failure, _ = api.run([*options, str(written(tmp_path / "script.py", SCRIPT + "\n".join(WRONG) + "\n"))])
    assert not failure, failure
    first = 1 + SCRIPT.count("\n")
    lines = {int(line.split(":")[1]) for line in report.splitlines() if "script.py" in line and ": error:" in line}
    assert lines == set(range(first, first + len(WRONG))), report
