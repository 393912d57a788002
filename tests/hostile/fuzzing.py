"""How long a fuzzer goes on, and from which seed.

`TRACKDYN_FUZZ_SECONDS` is the time of each of them (1 s by default). Seeds count up from 0, so that a run fails or
passes twice; `TRACKDYN_FUZZ_SEED=new` starts where no run has been, a number there repeats a run that failed, whose
seed the test printed.
"""

import inspect
import os
import time
from itertools import count

import hypothesis
from hypothesis import HealthCheck, Phase, given

SECONDS = float(os.environ.get("TRACKDYN_FUZZ_SECONDS", "1"))
ASKED = os.environ.get("TRACKDYN_FUZZ_SEED", "0")
SEED = time.time_ns() % 2**32 if ASKED == "new" else int(ASKED)
# no search for a smaller failure: what is drawn is small, and a search has no bound in time
BATCH = hypothesis.settings(
    max_examples=10, deadline=None, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)


def batches():
    """Seeds, one after the other and each of them printed, until the time is over; at least one."""
    end = time.monotonic() + SECONDS
    for seed in count(SEED):
        print(f"TRACKDYN_FUZZ_SEED={seed}")
        yield seed
        if time.monotonic() > end:
            return


def fuzz(**drawn):
    """A test whose parameters named here are drawn by Hypothesis, batch after batch; the others are fixtures."""

    def decorate(test):
        fixtures = [
            parameter for parameter in inspect.signature(test).parameters.values() if parameter.name not in drawn
        ]

        def repeated(**drawn_values):
            def once(**values):
                test(**drawn_values, **values)

            for seed in batches():
                hypothesis.seed(seed)(BATCH(given(**drawn)(once)))()

        repeated.__name__, repeated.__doc__ = test.__name__, test.__doc__
        repeated.__signature__ = inspect.Signature(fixtures)
        return repeated

    return decorate
