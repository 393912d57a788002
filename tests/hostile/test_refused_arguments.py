"""Arguments of a wrong type to what a program in Python calls: one sentence each, before anything is computed."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from sentences import BELT, one_sentence

import trackdyn
from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.validation import typed
from trackdyn.measure.axes import judge_axes
from trackdyn.measure.compare import compare_with_sensor
from trackdyn.measure.planner import plan
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.sections import Wheel
from trackdyn.scene.scene import Scene
from trackdyn.sensor.sensor_csv import read_sensor, write_sensor_csv
from trackdyn.sensor.sensor_mapping import load_mapping
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import load_recording
from trackdyn.sweeps.ring import ring_study

JUNK = [3.7, True, b"bytes", [1], {"a": 1}, object, 1j, np.zeros(3)]
NAMES = [None, *JUNK]  # for what must be a name or a thing of a class
CALLS = {
    "Loop": (lambda rig, run, x: Loop(x), [*NAMES, "paper"]),
    "Loop, starts": (lambda rig, run, x: Loop(run.scene, x), [*JUNK, "x"]),
    "Loop.load": (lambda rig, run, x: Loop.load(x), NAMES),
    "simulate": (lambda rig, run, x: trackdyn.simulate(x), [*NAMES, "paper"]),
    "simulate, by name": (lambda rig, run, x: trackdyn.simulate(scene=x), [*NAMES, "paper"]),
    "simulate, progress": (lambda rig, run, x: trackdyn.simulate(run.scene, progress=x), [None, 3.7, "yes", [1]]),
    "simulate, checkpoint": (lambda rig, run, x: trackdyn.simulate(run.scene, checkpoint=x), [*JUNK, "b\0"]),
    "plan": (lambda rig, run, x: plan(x, {"rms": 0.01}), [*NAMES, "/"]),
    "write_sensor_csv": (lambda rig, run, x: write_sensor_csv("a.csv", [0, 1], x, None, None), [*JUNK, "x"]),
    "write_sensor_csv, times": (lambda rig, run, x: write_sensor_csv("a.csv", x, [0, 1], None, None), NAMES),
    "load_rig": (lambda rig, run, x: load_rig(x), NAMES),
    "load_recording": (lambda rig, run, x: load_recording(x), NAMES),
    "sense": (lambda rig, run, x: trackdyn.sense(x), [*NAMES, "run.npz"]),
    "sense, every": (lambda rig, run, x: trackdyn.sense(run, x), [*NAMES, "2"]),
    "measures": (lambda rig, run, x: trackdyn.measures(x), [*NAMES, "run.npz"]),
    "show": (lambda rig, run, x: trackdyn.show(x), NAMES),
    "show, seconds": (lambda rig, run, x: trackdyn.show(run, seconds=x), [True, "1", [1], 1j]),
    "sweep": (lambda rig, run, x: trackdyn.sweep(x), NAMES),
    "sweep, store": (lambda rig, run, x: trackdyn.sweep("design.csv", store=x), JUNK),
    "ring_study": (lambda rig, run, x: ring_study("paper", x), [None, 115.0, 115, "115", {"a": 1}]),
    "read_sensor": (lambda rig, run, x: read_sensor(x), [*NAMES, -1]),
    "read_sensor, gravity": (lambda rig, run, x: read_sensor("a.csv", gravity=x), [*NAMES, "x"]),
    "read_sensor, mapping": (lambda rig, run, x: read_sensor("a.csv", x), [*JUNK, "x"]),
    "load_mapping": (lambda rig, run, x: load_mapping(x), JUNK),
    "judge_axes": (lambda rig, run, x: judge_axes(run, x), NAMES),
    "compare_with_sensor": (lambda rig, run, x: compare_with_sensor(x, x), NAMES),
    "save": (lambda rig, run, x: run.save(x), [*NAMES, "b\0"]),
    "value": (lambda rig, run, x: rig.value(x), NAMES),
    "Rig": (lambda rig, run, x: Rig(chain=x), [*NAMES, "x"]),
    "Wheel": (lambda rig, run, x: Wheel(x=x), [*NAMES, "x"]),
    "Scene": (lambda rig, run, x: Scene(rig, x), [None, *JUNK[1:], "fast"]),
}  # fmt: skip


@pytest.fixture(scope="module")
def run(rig):
    return trackdyn.simulate(Scene(rig, 115.0, **BELT, duration=0.5))


@pytest.mark.parametrize("row", [(name, x) for name, (_, junk) in CALLS.items() for x in junk], ids=shown)
def test_an_argument_of_another_type_is_refused(rig, run, row, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (name, value), (call, _) = row, CALLS[row[0]]
    with pytest.raises(InputError) as caught:
        call(rig, run, value)
    one_sentence(caught)
    assert not list(tmp_path.iterdir()), name


def test_containers_and_callables_are_said_in_words():
    @typed
    def call(many: Sequence[float] = (), tick: Callable[[list[int]], None] | None = None, table: dict[str, int] = {}):  # noqa: B006
        return many, tick, table

    assert call([1.0], print, {"a": 1})
    for arguments, said in (
        ({"many": 210}, "many = 210: must be a sequence such as a list"),
        ({"tick": 0}, "tick = 0: must be a function or None"),
        ({"table": [1]}, "table = \\[1\\]: must be a mapping"),
    ):
        with pytest.raises(InputError, match=f"^{said}$"):
            call(**arguments)


def test_arguments_of_the_declared_type_pass():
    @typed
    def call(number: float, count: int = 1, text: str | None = None, *rest: int, flag: bool = False) -> tuple:
        return number, count, text, flag

    assert call(np.float32(1), 2.0, flag=np.True_) == (1.0, 2.0, None, True)
    assert call(np.array(3), np.int64(2), "a")[:2] == (3, 2)
    for arguments, field in (((1.0, 1.5), "count"), ((float("nan"), True), "count"), ((1.0, 1, 2), "text")):
        with pytest.raises(InputError, match=f"^{field} = "):
            call(*arguments)
