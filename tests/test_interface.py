"""The interface: names, help, completion, tables of a notebook."""

import inspect
import pydoc
import re
import subprocess
import sys

import pytest
from pydantic import BaseModel

import trackdyn
from tests.conftest import BELT, ROOT
from trackdyn.measure.sensor import sense
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording

SCENE = Scene(load_rig("paper"), 115.0)


@pytest.fixture(scope="module")
def recording():
    return belt_recording(Scene(load_rig("paper"), 115.0, **BELT, duration=4.0))


@pytest.mark.parametrize(
    "owner", [Rig, Scene, SCENE, SCENE.rig, SCENE.rig.chain], ids=lambda owner: type(owner).__name__
)
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
    parameters = inspect.signature(Scene).parameters
    assert [*parameters] == ["rig", "motor_rpm", "ring_radius", "preset", *[
        name for name in Scene.model_fields if name not in ("rig", "motor_rpm", "ring_radius")
    ]]  # fmt: skip
    for name, parameter in parameters.items():
        if name != "preset" and parameter.default not in (inspect.Parameter.empty, "of the rig"):
            assert getattr(SCENE, name) == parameter.default
    assert {parameters[name].default for name in ("chain", "drag", "tension")} == {"of the rig"}


def test_a_notebook_shows_tables(recording):
    for shown, words in (
        (SCENE, "115 rev/min"),
        (recording, "4 s, 4000 samples at 1000 Hz"),
        (sense(recording), "ay_g"),
    ):
        text = shown._repr_html_()
        assert words in text and text.count("<table") == 1 and "<Rig" not in text and len(text) < 20_000
    assert re.fullmatch(
        r"<SensorSignal: 4000 samples at 1000 Hz; ax \S+ g RMS, ay \S+ g RMS; 0 clipped>", repr(sense(recording))
    )


def test_a_signal_is_drawn_into_given_axes(recording):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure, ax = pyplot.subplots()
    assert sense(recording).plot(ax=ax) is ax and len(ax.lines) == 2
    pyplot.close(figure)


@pytest.mark.parametrize("words", ["trackdyn simulate run.npz --rig be", "trackdyn ring be"])
def test_a_shell_completes_rigs(words):
    done = subprocess.run(
        [sys.executable, "-m", "trackdyn"], capture_output=True, text=True, cwd=ROOT,
        env={"_TRACKDYN_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)},
    )  # fmt: skip
    assert done.stdout.split() == ["bench"], done.stderr
