"""Says that kernels are being compiled, which the first run on a machine spends most of its time on."""

from collections.abc import Callable

from numba.core import event


class _Once(event.Listener):
    """Calls a function when the first kernel is compiled; one that is taken from the cache is not."""

    def __init__(self, say: Callable[[str], object]):
        self.say = say

    def on_start(self, event):
        self.say("compiling kernels, about half a minute; the next run finds them")
        self.say = lambda text: None

    def on_end(self, event):
        pass


def announce(say: Callable[[str], object]) -> None:
    """Have ``say`` called with one sentence when the first kernel of this process is compiled, if any is."""
    event.register("numba:compile", _Once(say))
