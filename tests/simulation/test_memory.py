"""Memory of loops that start and stop, and of one that goes on: it does not grow.

Counted are Python's blocks of memory, one or more an object, also an array's. Kernels allocate nothing: one that would
is refused when it is compiled (`trackdyn.jit`).
"""

import gc
import sys
import weakref

import pytest

from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.settling import SettledLoops

CYCLES, CALLS = 25, 2000


@pytest.fixture(scope="module")
def scene(make_scene):
    return make_scene(115.0, ring_radius=None)


def left_by(act, times):
    """Blocks that stay when something is done so many times, after it has been done three times as often.

    Before that, numba's dispatcher and Python fill lists of small objects that they use again: some hundreds of blocks,
    fewer and fewer in the first 300 calls.
    """
    blocks = []
    for rounds in (3, 1):
        for _ in range(rounds * times):
            act()
        gc.collect()
        blocks.append(sys.getallocatedblocks())
    return blocks[1] - blocks[0]


def test_loops_that_start_and_stop_leave_nothing_behind(scene):
    """Less than ten objects a cycle: a loop has hundreds."""
    starts = SettledLoops()

    def cycle():
        loop = Loop(scene, starts)
        loop.advance(0.002)
        loop.record(0.005)

    assert left_by(cycle, CYCLES) < 10 * CYCLES


def test_a_loop_that_goes_on_takes_no_more_memory(scene):
    """Less than one object in ten calls."""
    assert left_by(Loop(scene).step, CALLS) < CALLS / 10


def test_a_record_goes_with_its_last_reference(scene):
    """The collector of cycles counts objects, not bytes: in a cycle, records of many runs would pile up."""
    gc.collect()
    gc.disable()
    try:
        writer = Recorder(Loop(scene), scene.with_(duration=0.05, every_link=True))
        while not writer.finished:
            writer.chunk()
        reference = weakref.ref(writer)
        del writer
        assert reference() is None
    finally:
        gc.enable()
