"""A user and the arrays of a loop: they are read only, and one thread steps them."""

import threading

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn.simulation.loop_arrays import flatten


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
