"""Chatter: where a contact is too stiff for the step, its force flips from one step to the next.

All bodies are looked at (`integrate.run`), so that a few pitches on the sprocket tell what one sensor's link shows
after a turn of the loop. A peak force that lasts one step is not resolved, either (`integrate.contact_log`).
"""

import numpy as np

from trackdyn.model.constants import Model
from trackdyn.simulation.energy_balance import passed_pitches

# Alternating share that is suspect. Set on a pilot (docs/speed-and-accuracy.md), no run of which that stayed below it
# was 2 % off in RMS.
NOTICED = 0.01
# Share of the mean peak in peaks that stand for one step, with a neighbour below half: the true one may be as much as
# twice as large, so that a tenth of the mean peak may be half off, which is ``PEAKS``.
ONE_STEP = 0.1
# Least number of samples before a verdict.
LEAST_LOOKS = 10


def alternating_share(alternating, model: Model, mean) -> float:
    """Mean square of the alternation from step to step, as a share of the mean square that the sensor reads.

    ``alternating`` holds the (2,) sums over a record (`model.arrays.Work`), ``mean`` (s, 3) is that of the record.
    """
    alternations, looks = alternating
    if not looks or not len(mean):
        return float("nan")
    gravity = float(model.chain.gravity)
    read = float(((mean[:, 1] + gravity * np.cos(mean[:, 2])) ** 2).mean())
    # without gravity and motion there is rounding alone
    return float(alternations / looks / model.step**2 / max(read, 1e-6))


def unresolved_reason(alternating, model: Model, mean, seconds: float, isolated: float) -> str:
    """Why a record or a piece of ``seconds`` may be unresolved, or an empty string.

    The first three arguments are as in `alternating_share`, ``isolated`` is that of `step_check.RunStatistics`.
    """
    if passed_pitches(model, seconds) < 1.0 or alternating[1] < LEAST_LOOKS:
        return ""
    if (share := alternating_share(alternating, model, mean)) > NOTICED:
        return f"what flips from step to step is {share:.2g} of the mean square that the sensor reads"
    if isolated > ONE_STEP:
        return f"{isolated:.0%} of the mean peak are forces that stand for one step"
    return ""
