"""Says that kernels are being compiled, which the first run on a machine spends most of its time on."""

from collections.abc import Callable

from numba.core import event

# Measured on one core of the machine of the benchmarks; other kinds of scene compile some more later on.
SECONDS = 60


class _Once(event.Listener):
    """Calls a function when the first kernel is compiled; one that is taken from the cache is not."""

    def __init__(self, say: Callable[[str], object]):
        self.say = say

    def on_start(self, event):
        self.say(f"compiling kernels, which are kept; about {SECONDS} s, and longer beside other work")
        self.say = lambda text: None

    def on_end(self, event):
        pass


def announce(say: Callable[[str], object]) -> None:
    """Have ``say`` called with one sentence when the first kernel of this process is compiled, if any is."""
    event.register("numba:compile", _Once(say))
