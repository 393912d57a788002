"""Memory of loops that start and stop, and of one that goes on: it does not grow."""

import gc
import tracemalloc

import numpy as np
import pytest

from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settled_loops import SettledLoops

CYCLES = 200
CALLS = 1000
STEPS = 10_000
FLOAT = 24  # bytes of one of Python's


@pytest.fixture(scope="module")
def scene(make_scene):
    return make_scene(115.0, ring_radius=None)


@pytest.fixture
def traced():
    """Bytes that are held; what only waits to be collected is not."""
    tracemalloc.start()

    def held():
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    yield held
    tracemalloc.stop()


def cycle(scene, starts):
    """A loop starts, runs, is recorded and stops; returns the bytes of its record."""
    loop = Loop(scene, starts)
    loop.advance(0.002)
    recording = loop.record(0.005)
    return sum(np.asarray(getattr(recording, name)).nbytes for name in recording.ARRAYS)


def test_loops_that_start_and_stop_leave_nothing_behind(scene, traced):
    """What 200 cycles leave is less than ten of their records; one that stayed each time would leave 200."""
    starts = SettledLoops()
    for _ in range(5):  # kernels, caches
        size = cycle(scene, starts)
    before = traced()
    for _ in range(CYCLES):
        cycle(scene, starts)
    assert traced() - before < 10 * size


def test_a_loop_that_goes_on_takes_no_more_memory(scene, traced):
    """Neither by calls (less than a number each stays) nor by steps: a day of them takes what a second does."""
    loop = Loop(scene)

    def calls():
        for _ in range(CALLS):
            loop.step()

    for _ in range(3):  # what Python keeps to use again fills up
        calls()
    before = traced()
    calls()
    assert traced() - before < CALLS * FLOAT
    before = traced()
    tracemalloc.reset_peak()
    loop.step(STEPS)
    assert tracemalloc.get_traced_memory()[1] - before < STEPS
