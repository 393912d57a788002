"""A user and the arrays of a loop: look at them, set a state that is checked, fill records that are its own."""

import pickle
import threading

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn.inputs.errors import InputError
from trackdyn.simulation.loop_arrays import flat


@pytest.fixture
def loop(driven_loop):
    return driven_loop()


def test_arrays_of_a_loop_are_read_only(loop):
    """Kernels look up places unchecked: every array that a loop shows."""
    for name in ("model", "state", "work"):
        for array in flat(getattr(loop, name)).values():
            if array.ndim and array.size:
                with pytest.raises(ValueError, match="read-only"):
                    array[...] = array
        with pytest.raises(AttributeError):
            setattr(loop, name, getattr(loop, name))


STATES = {
    "one more": ({"rate": lambda a: np.append(a, 0.0)}, "state.rate = array([", "must be float64 of the shape (70,)"),
    "cut": ({"wheel_rate": lambda a: a[:1]}, "of the shape (3,)"),
    "None": ({"rate": lambda a: None}, "state.rate = None"),
    "text": ({"rate": lambda a: a.astype(str)}, "must be float64"),
    "steps and a half": ({"steps": lambda a: a + 0.5}, "must be int64"),
    "steps beyond all integers": ({"steps": lambda a: [10**400]}, "must be int64"),
    "not a number": ({"pin": lambda a: a * np.nan}, "state.pin holds nan"),
    "far away": ({"pin": lambda a: a + 1e300}, "state.pin holds 1e+300: must be between -1e+06 and 1e+06"),
    "before the start": ({"steps": lambda a: a * 0 - 9}, "state.steps holds -9"),
    "of space": ({"plane__motion": lambda a: 1.0}, "state: 'plane.motion' is not one of its arrays, steps, pin, angle"),
    "the second one": ({"rate": lambda a: 0 * a, "pin": lambda a: a * np.nan}, "state.pin holds nan"),
}


@pytest.mark.parametrize("name", STATES)
def test_a_state_that_no_loop_can_have_is_refused_and_changes_nothing(loop, name):
    changes, *words = STATES[name]
    before = loop.copy()
    stated = {field: change(getattr(loop.state, field, None)) for field, change in changes.items()}
    refused(lambda: loop.set_state(**stated), words=words)
    for field, array in flat(loop.state).items():
        np.testing.assert_array_equal(array, flat(before.state)[field])


def test_numbers_of_the_state_may_be_changed(loop):
    """Also of a loop that was copied or pickled; lists and integers are numbers, too."""
    for other in (loop, loop.copy(), pickle.loads(pickle.dumps(loop))):
        other.set_state(rate=(1.001 * other.rates).tolist(), pin=other.state.pin, steps=[7])
        assert other.time == 7 * other.model.step and other.rates[3] != 0.0
        other.step()
        assert np.isfinite(other.pins).all() and np.abs(other.rates).max() < 100.0


def test_a_second_thread_is_refused_and_the_first_one_goes_on(loop):
    alone, inside, go_on = loop.copy(), threading.Event(), threading.Event()

    def tick(seconds):
        inside.set()
        assert go_on.wait(60)

    first = threading.Thread(target=lambda: loop.advance(0.6, tick))
    first.start()
    assert inside.wait(60)
    calls = loop.step, lambda: loop.advance(0.1), lambda: loop.record(0.1), lambda: loop.set_state(steps=[0])
    for call in calls:
        with pytest.raises(InputError, match="another thread steps this loop; give each thread a copy"):
            call()
    go_on.set()
    first.join(60)
    alone.advance(0.6)
    np.testing.assert_array_equal(loop.pins, alone.pins)
    loop.step()  # free again
