"""Recordings, rigs, scenes and the arrays of a loop cannot be changed; one thread steps a loop."""

import copy
import pickle
import threading
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn import Rig, Scene, load_recording, load_rig
from trackdyn.simulation.loop_arrays import flatten


@pytest.mark.parametrize("change", [lambda loaded: loaded, copy.copy, replace, lambda loaded: loaded.with_sensor(0)])
def test_recorded_arrays_are_read_only(belt_file, change):
    recording = change(load_recording(belt_file))
    arrays = [array for name in recording.ARRAYS if isinstance(array := getattr(recording, name), np.ndarray)]
    assert len(arrays) > 8 and not [array for array in arrays if array.flags.writeable]
    with pytest.raises(ValueError, match="read-only"):
        recording.mean[:] = 0


@pytest.mark.parametrize(("change", "arguments"), {
    "update": [{"idler": 1}], "__setitem__": ["idler", 1], "clear": [], "pop": ["idler"], "popitem": [],
    "setdefault": ["x", 1], "__delitem__": ["idler"], "__ior__": [{"x": 1}],
}.items())  # fmt: skip
def test_arrays_and_dictionaries_of_rigs_and_scenes_are_frozen(rig, change, arguments):
    scene, before = Scene(rig, 115.0), rig.model_dump_json()
    own = (getattr(rig, name) for name in ("wheels", "surfaces", "sensors", "fields", "equal_pitch_radii"))
    for dictionary in (*own, scene.sensors, scene.fidelity, scene.rig.wheels):
        refused(getattr(dictionary, change), *arguments, words=["cannot be changed"])
    assert rig.model_dump_json() == before
    for array in (rig.groove_profile.radius, rig.groove_profile.centre):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0


@pytest.mark.parametrize("name", ["paper", "bench"])
def test_a_frozen_rig_is_copied_compared_and_hashed(name):
    rig = load_rig(name)
    twins = pickle.loads(pickle.dumps(rig)), copy.deepcopy(rig), Rig.model_validate(rig.model_dump()), load_rig(name)
    for twin in twins:
        assert twin == rig and hash(twin) == hash(rig) and type(twin.wheels) is type(rig.wheels)
    assert hash(Scene(rig, 115.0)) == hash(Scene(load_rig(name), 115)) != hash(Scene(rig, 116.0))
    assert {Scene(rig, 115.0): 1}[Scene(load_rig(name), 115.0)] == 1


def test_an_assignment_is_refused_with_a_remedy(rig):
    scene = Scene(rig, 115.0)
    for call, words in (
        (lambda: setattr(rig, "gravity", 1.0), ["rig: gravity cannot be changed; rig.changed(...)"]),
        (lambda: setattr(scene, "motor_rpm", 1.0), ["scene: motor_rpm cannot be changed; scene.with_(...)"]),
        (lambda: delattr(rig.chain, "pitches"), ["pitches cannot be changed"]),
        (lambda: rig.model_copy(update={"gravity": -9.81}), ["gravity = -9.81"]),
        (lambda: scene.model_copy(update={"motor_rpm": "fast"}), ["motor_rpm = 'fast'"]),
        (lambda: Scene(rig, 115, motor_rpm=120), ["scene: multiple values for argument 'motor_rpm'"]),
        (lambda: Scene(rig), ["scene: missing a required argument: 'motor_rpm'"]),
        (lambda: Scene(rig, 115.0, pitches=(1, 2, 1)), ["pitches = (1, 2, 1): holds 1 twice"]),
    ):
        refused(call, words=words)
    assert rig.model_copy(update={"gravity": 1.62}).gravity == 1.62 and rig.model_copy() == rig
    assert scene.model_copy(update={"motor_rpm": 120.0}) == Scene(rig, 120.0)


def test_arrays_of_a_loop_are_read_only(driven_loop):
    """Kernels look up places unchecked: every array that a loop shows."""
    loop = driven_loop()
    for name in ("model", "state", "work"):
        for array in flatten(getattr(loop, name)).values():
            if array.ndim and array.size:
                with pytest.raises(ValueError, match="read-only"):
                    array[...] = array
        with pytest.raises(AttributeError):
            setattr(loop, name, getattr(loop, name))


def test_a_second_thread_is_refused_and_the_first_one_goes_on(driven_loop):
    loop, undisturbed, inside, go_on = driven_loop(), driven_loop(), threading.Event(), threading.Event()

    def tick(seconds):
        inside.set()
        assert go_on.wait(60)

    first = threading.Thread(target=lambda: loop.advance(0.6, tick))
    first.start()
    assert inside.wait(60)
    for call in (loop.step, lambda: loop.advance(0.1), lambda: loop.record(0.1)):
        refused(call, match="another thread steps this loop; give each thread a copy")
    go_on.set()
    first.join(60)
    undisturbed.advance(0.6)
    np.testing.assert_array_equal(loop.pins, undisturbed.pins)
    loop.step()  # free again
