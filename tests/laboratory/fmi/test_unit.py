"""A track as a unit for co-simulation: valid by the standard, and the same numbers as the loop itself."""

import subprocess
import sys

import numpy as np
import pytest

from laboratory.fmi.unit import Strands, Unit
from tests.kinematics import next_samples, set_model
from trackdyn.errors import InputError
from trackdyn.measure.sensor import specific_force
from trackdyn.rig.rig import Rig
from trackdyn.scene.choices import preset
from trackdyn.simulation.loop import Loop

pytestmark = pytest.mark.slow  # an importer turns what a unit raises into a status
EXCHANGE = 1e-3
# the unit passes doubles on: only the time of a step could differ
SAME = 1e-9


@pytest.fixture(scope="module")
def driven_rig(rig):
    """The shipped rig with a motor of a line and a tensioner that is pushed.

    The surface of its own, equal to that of the others, makes its kernels those of `tests/rigs/test_drives.py`.
    """
    data = rig.model_dump(mode="json")
    data["surfaces"], data["wheels"]["idler"]["surface"] = {"same": data["wheel_contact"]}, "same"
    data["drive"] = {"kind": "motor", "inertia": 40.0, "slope": 2000.0, "torque": 900.0}
    data["tension"] |= {"kept": "forced", "force": [[0.0, 9000.0]], "damping": 2e4}
    return Rig.model_validate(data)


@pytest.fixture(scope="module")
def scene(make_scene):
    return make_scene(115.0, lead_in=0.0, **preset("fast"))


@pytest.fixture(scope="module")
def unit_file(scene, tmp_path_factory):
    pytest.importorskip("pythonfmu3", reason="PythonFMU3 is not installed")
    from laboratory.fmi.build import write_fmu

    path = tmp_path_factory.mktemp("fmu") / "track.fmu"
    write_fmu(scene, path)
    assert [file.name for file in path.parent.iterdir()] == ["track.fmu"]
    return path


def test_the_unit_keeps_the_standard(unit_file):
    validation = pytest.importorskip("fmpy.validation", reason="FMPy is not installed")
    assert validation.validate_fmu(str(unit_file)) == []


NAMES = ("rate_sprocket", "rate_idler", "rate_road_wheel", "sensor_ax", "sensor_ay", "sprocket_torque", "gap")


def test_the_unit_is_the_loop(unit_file, scene, tmp_path):
    """As an importer has it, beside the loop itself with the same inputs; a new speed comes, then a shift."""
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
    description = fmpy.read_model_description(str(unit_file))
    numbers = {variable.name: variable.valueReference for variable in description.modelVariables}
    unit, loop = fmpy.instantiate_fmu(fmpy.extract(str(unit_file), tmp_path), description, "CoSimulation"), Loop(scene)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    settled, count = loop.layout["tensioner_shift_m"], round(EXCHANGE / scene.time_step)
    set_model(loop, stride=1)  # rows of one step: the mean over the exchange is theirs
    outputs, native = [], []
    for k in range(600):
        if k == 300:
            unit.setFloat64([numbers["motor_rpm"]], [140.0])
            loop.drive(140.0, EXCHANGE)
        if k == 450:
            unit.setFloat64([numbers["tensioner_shift"]], [-1e-3])
            loop.shift_tensioner(settled - 1e-3)
        unit.doStep(currentCommunicationPoint=k * EXCHANGE, communicationStepSize=EXCHANGE)
        outputs.append(unit.getFloat64([numbers[name] for name in NAMES]))
        work, angle = loop.energy["sprocket_work"], loop.state.wheel_angle[0]
        mean = next_samples(loop, count).mean.mean(axis=0)[0]
        felt = specific_force(mean[:2], mean[2], scene.rig.gravity) / scene.rig.gravity
        torque = (loop.energy["sprocket_work"] - work) / (loop.state.wheel_angle[0] - angle)
        native.append([*loop.wheel_rates, *felt, torque, loop.gap])
    unit.terminate()
    unit.freeInstance()
    outputs, native = np.array(outputs), np.array(native)
    scale = np.abs(native).max(axis=0)
    assert (np.abs(outputs - native).max(axis=0)[:-1] <= SAME * scale[:-1]).all()
    assert outputs[:, -1].max() < 1e-10  # both gaps are rounding
    assert scale[0] > 1 and scale[5] > 10  # something turned, and took work
    assert np.abs(outputs[310:, 0]).min() > np.abs(outputs[:300, 0]).max()  # the input was heard


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"chain": "belt", "ring_radius": None, "contact_log": False}, "chain = 'belt':"),
        ({"loop": "free", "ring_radius": None}, "loop = 'free':"),
        ({"space": "spatial"}, "space = 'spatial':"),
    ],
)
def test_scenes_without_a_unit_are_refused(make_scene, fields, sentence):
    with pytest.raises(InputError, match=sentence):
        Unit(make_scene(115.0, **fields))


def test_strand_tension_is_that_between_its_joints():
    """Joints along a strand from (0, 1) to (4, 1), force growing by 10 N/m from 100 N: 120 N in the middle, always."""
    circles = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]])
    strands = Strands(circles, ["a", "b"])
    assert strands.middle == pytest.approx(np.array([[2.0, 1.0], [2.0, -1.0]]))
    for shift in np.linspace(0.0, 0.5, 7):
        x = np.arange(0.0, 4.0, 0.5) + shift
        upper, lower = np.column_stack([x, np.ones(8)]), np.column_stack([x[::-1], -np.ones(8)])
        forces = np.column_stack([np.concatenate([100 + 10 * x, 300 - 10 * x[::-1]]), np.zeros(16)])
        assert strands.tension(np.vstack([upper, lower]), forces) == pytest.approx([120.0, 280.0])


def test_a_unit_starts_at_rest_under_its_pre_tension(scene):
    unit = Unit(scene)
    unit.start()
    assert unit.values["rate_sprocket"] == unit.values["sprocket_torque"] == 0.0
    # at rest the sensor feels the weight alone, whichever way its link is tilted
    assert np.hypot(unit.values["sensor_ax"], unit.values["sensor_ay"]) == pytest.approx(1.0)
    tensions = [value for name, value in unit.values.items() if name.startswith("tension_")]
    settled = unit.loop.layout["settled_tension_n"]  # at the cut, in the strand from the idler to the sprocket
    assert unit.values["tension_idler_to_sprocket"] == pytest.approx(settled, rel=0.01)
    assert len(tensions) == 3


def test_the_torque_limit_is_what_turns_the_sprocket(make_scene, driven_rig):
    """Newton: what the drive gives turns sprocket, gear and rotor, and through them the chain."""
    unit = Unit(make_scene(300.0, rig=driven_rig, lead_in=0.0, ramp=1e-3))
    assert [signal.name for signal in unit.inputs] == ["motor_rpm", "torque_limit", "tensioner_force"]
    unit.start()
    for limit, start in ((900.0, 0.0), (500.0, 0.1)):
        unit.wanted["torque_limit"] = limit
        for k in range(20):  # the first exchanges after a jump of the torque shake the chain
            unit.step(start + k * EXCHANGE, EXCHANGE)
        before, taken = unit.values["rate_sprocket"], []
        for k in range(20, 100):
            unit.step(start + k * EXCHANGE, EXCHANGE)
            taken.append(unit.values["sprocket_torque"])
        gained = driven_rig.drive.inertia * (unit.values["rate_sprocket"] - before) / (80 * EXCHANGE)
        # clockwise is negative; a mean over the turn is that over time but for what the rate changes in an exchange
        assert gained == pytest.approx(-limit - np.mean(taken), abs=0.01 * limit)
        assert np.mean(taken) < -50.0  # the chain took some of it
    assert abs(unit.values["rate_sprocket"]) < 0.9 * abs(unit.loop.scene.sprocket_rate)


# every call is refused with a status, and the unit goes on or ends
SEQUENCE = """
import sys
from math import inf, nan
import fmpy

path = sys.argv[1]
description = fmpy.read_model_description(path)
numbers = {variable.name: variable.valueReference for variable in description.modelVariables}
unit = fmpy.instantiate_fmu(fmpy.extract(path), description, "CoSimulation")

def refused(status, call, *arguments):
    try:
        call(*arguments)
    except Exception as error:
        assert f"status {status}" in str(error), error
        return
    raise AssertionError(f"{call} {arguments} was accepted")

def step(time, length=1e-3):
    unit.doStep(currentCommunicationPoint=time, communicationStepSize=length)

refused(3, step, 0.0)
refused(4, unit.exitInitializationMode)
refused(4, unit.getFMUState)
unit.enterInitializationMode()
refused(4, unit.enterInitializationMode)
refused(3, step, 0.0)
unit.exitInitializationMode()
refused(4, unit.exitInitializationMode)
step(5.0)  # the first exchange says when the importer's clock starts
step(5.001)
before = unit.getFloat64([numbers["rate_sprocket"]])
for time, length in ((5.0, 1e-3), (99.0, 1e-3), (5.0025, 1e-3), (nan, 1e-3), (inf, 1e-3),
                     (5.002, nan), (5.002, inf), (5.002, -1e-3), (5.002, 0.0), (5.002, 1e300)):
    refused(3, step, time, length)
assert unit.getFloat64([numbers["rate_sprocket"]]) == before
for name in ("gap", "rate_sprocket", "time"):
    refused(4, unit.setFloat64, [numbers[name]], [1.0])
refused(4, unit.setFloat64, [999], [1.0])
refused(4, unit.getFloat64, [999])
refused(4, unit.getInt32, [numbers["gap"]])
for value in (nan, inf, -1.0, 1e300):
    unit.setFloat64([numbers["motor_rpm"]], [value])
    refused(3, step, 5.002)
unit.setFloat64([numbers["motor_rpm"]], [115.0])
unit.setFloat64([numbers["tensioner_shift"]], [0.4])
refused(3, step, 5.002)
unit.setFloat64([numbers["tensioner_shift"]], [0.0])
unit.setFloat64([numbers["speed_ramp"]], [nan])
refused(3, step, 5.002)
unit.setFloat64([numbers["speed_ramp"]], [0.0])
kept = unit.getFMUState()
refused(4, unit.serializeFMUState, kept)
step(5.002)
outputs = [variable.valueReference for variable in description.modelVariables if variable.causality == "output"]
after = unit.getFloat64(outputs)
unit.setFloat64([numbers["motor_rpm"]], [200.0])
step(5.003)
unit.setFMUState(kept)
assert unit.getFloat64([numbers["motor_rpm"]]) == [115.0]
refused(3, step, 5.003)
step(5.002)
assert unit.getFloat64(outputs) == after
assert unit.getFloat64([numbers["rate_sprocket"]]) != before
unit.freeFMUState(kept)
unit.terminate()
refused(3, step, 5.003)
refused(4, unit.terminate)
refused(4, unit.setFloat64, [numbers["motor_rpm"]], [115.0])
unit.reset()
unit.enterInitializationMode()
unit.exitInitializationMode()
step(0.0)
unit.terminate()
unit.freeInstance()
print("whole")
"""


def test_calls_out_of_order_are_refused_and_the_importer_lives(unit_file):
    """In a process of its own: PythonFMU3 drops references at every exception, and the next call crashed."""
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    command = [sys.executable, "-c", SEQUENCE, str(unit_file)]
    run = subprocess.run(command, capture_output=True, text=True)
    said = run.stdout + run.stderr
    assert run.returncode == 0 and "whole" in run.stdout, said[-3000:]
    assert "Traceback" not in said
    for sentence in (
        "time = 99 s: must be the time of the unit, 5.002 s",
        "exchange = inf s:",
        "motor_rpm = nan:",
        "tensioner_shift = 0.4 m: must be between",
        "the unit cannot step while it is terminated",
        "gap cannot be written; only inputs and parameters can",
        "cannot be written to a file",
    ):
        assert sentence in said, sentence
