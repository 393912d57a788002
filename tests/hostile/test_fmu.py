"""A co-simulation unit in the hands of an importer that does not keep the standard."""

import subprocess
import sys
from math import inf, nan

import pytest

from trackdyn.scene.fidelity import preset

pytest.importorskip("pythonfmu3", reason="PythonFMU3 is not installed")
pytest.importorskip("fmpy", reason="FMPy is not installed")

# what goes before is said by `begun` and `stepped`; every call is refused with a status, and the unit goes on or ends
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
unit.setFloat64([numbers["speed_ramp"]], [nan])
refused(3, step, 5.002)
unit.setFloat64([numbers["speed_ramp"]], [0.0])
kept = unit.getFMUState()
refused(4, unit.serializeFMUState, kept)
step(5.002)
after = unit.getFloat64([numbers["rate_sprocket"]])
unit.setFMUState(kept)
refused(3, step, 5.003)
step(5.002)
assert unit.getFloat64([numbers["rate_sprocket"]]) == after != before
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


def test_calls_out_of_order_are_refused_and_the_importer_lives(make_scene, tmp_path):
    """In a process of its own: PythonFMU3 drops references at every exception, and the next call crashed."""
    from laboratory.fmi.build import write_fmu

    write_fmu(make_scene(115.0, lead_in=0.0, **preset("fast")), tmp_path / "track.fmu")
    run = subprocess.run(
        [sys.executable, "-c", SEQUENCE, str(tmp_path / "track.fmu")], capture_output=True, text=True, timeout=500
    )
    said = run.stdout + run.stderr
    assert run.returncode == 0 and "whole" in run.stdout, said[-3000:]
    assert "Traceback" not in said
    for sentence in (
        "time = 99 s: must be the time of the unit, 5.002 s",
        "exchange = inf s:",
        "the unit cannot step while it is terminated",
        "gap cannot be written; only inputs and parameters can",
        "cannot be written to a file",
    ):
        assert sentence in said, sentence


@pytest.mark.parametrize(("time", "exchange"), [(nan, 1e-3), (inf, 1e-3), (0.0, inf), (0.0, nan)])
def test_a_step_before_the_start_is_refused(make_scene, time, exchange):
    from laboratory.fmi.unit import Unit
    from trackdyn.errors import InputError

    with pytest.raises(InputError, match="the unit cannot step before its initialisation"):
        Unit(make_scene(115.0)).step(time, exchange)
