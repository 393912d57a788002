"""A call that a loop cannot take, and a recording that does not fit: refused in one sentence, nothing compiled."""

import sys

import pytest
from sentences import BELT, NUMBER, one_sentence

from tests.kinematics import unsettled_loop
from trackdyn.inputs.errors import InputError
from trackdyn.scene.scene import Scene
from trackdyn.simulation import recorder as needs
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.simulate import simulate

CALLS = [
    (lambda loop: loop.step(0), "count = 0: must be between 1 and"),
    (lambda loop: loop.step("ten"), "count = 'ten'", "must be a whole number"),
    (lambda loop: loop.advance(float("nan")), "seconds = nan", NUMBER),
    (lambda loop: loop.advance(-1), "seconds = -1", "between 0 and"),
    (lambda loop: loop.record(0), "duration = 0.0", "between 0.001 and"),
    (lambda loop: loop.record(0.1, pitches=[99]), "pitches = 99"),
    (lambda loop: loop.record(0.1, frame_interval=1e-9), "frame_interval = 1e-09"),
    (lambda loop: loop.drive("fast"), "motor_rpm = 'fast'", NUMBER),
    (lambda loop: loop.drive(115, ramp=0), "ramp = 0.0"),
    (lambda loop: loop.drive(60000), "step = 5e-05: too large for the turn of the sprocket (motor_rpm)"),
    (lambda loop: loop.shift_tensioner(1), "shift = 1:", "the tensioner's travel"),
    (lambda loop: loop.save("/proc/state"), "/proc/state: cannot be written"),
]


@pytest.mark.parametrize("row", CALLS, ids=lambda row: row[1][:40])
def test_a_call_of_a_loop_is_refused(rig, row):
    """A loop that was not settled: nothing is compiled."""
    call, *words = row
    loop = unsettled_loop(Scene(rig, 0.0, ring_radius=None))
    with pytest.raises(InputError) as caught:
        call(loop)
    one_sentence(caught, *words)


def test_a_recording_that_does_not_fit_into_the_memory_is_refused_before_it_starts(rig, monkeypatch):
    """Each of the ways to ask for one: by scene, as a belt, of a loop that runs."""
    monkeypatch.setattr(needs, "virtual_memory", lambda: type("Memory", (), {"available": 1e6}))
    monkeypatch.setattr(sys.modules["trackdyn.simulation.simulate"], "Loop", None)  # it must not come so far
    words = "duration = 90 s:", "MB of memory and 1 MB are free", "use at most"
    for fields in ({}, BELT):
        with pytest.raises(InputError) as caught:
            simulate(Scene(rig, 115.0, **fields))
        one_sentence(caught, *words)
    loop = type("Loop", (), {"scene": Scene(rig, 115.0)})
    with pytest.raises(InputError) as caught:
        Recorder(loop, loop.scene.with_(duration=90.0))
    one_sentence(caught, *words)
