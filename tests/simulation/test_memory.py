"""Memory of loops that start and stop, and of one that goes on: it does not grow.

Counted are Python's blocks of memory, one or more an object, also an array's. Kernels allocate nothing: one that would
is refused when it is compiled (`trackdyn.jit`).
"""

import gc
import itertools
import sys
import weakref

import pytest

from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.settled_loops import SettledLoops

CYCLES, CALLS = 200, 2000


@pytest.fixture(scope="module")
def scene(make_scene):
    return make_scene(115.0, ring_radius=None)


def left_by(act, times):
    """Blocks that stay each time that something was done so many times: the least of three rounds.

    The round before them fills what Python keeps to use again. A leak shows in every round, what another thread of the
    process allocates in one of them.
    """
    blocks = []
    for _ in range(4):
        for _ in range(times):
            act()
        gc.collect()
        blocks.append(sys.getallocatedblocks())
    return min(after - before for before, after in itertools.pairwise(blocks))


def test_loops_that_start_and_stop_leave_nothing_behind(scene):
    """Less than one object in two cycles: a loop has hundreds."""
    starts = SettledLoops()

    def cycle():
        loop = Loop(scene, starts)
        loop.advance(0.002)
        loop.record(0.005)

    assert left_by(cycle, CYCLES) < CYCLES / 2


def test_a_loop_that_goes_on_takes_no_more_memory(scene):
    """Less than one object in ten calls."""
    assert left_by(Loop(scene).step, CALLS) < CALLS / 10


def test_a_record_goes_with_its_last_reference(scene):
    """The collector of cycles counts objects, not bytes: in a cycle, records of many runs would pile up."""
    gc.collect()
    gc.disable()
    try:
        writer = Recorder(Loop(scene), 0.05, (), 0.0, True, True)
        while not writer.finished:
            writer.chunk()
        seen = weakref.ref(writer)
        del writer
        assert seen() is None
    finally:
        gc.enable()
