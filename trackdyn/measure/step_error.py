"""What the time step adds to the error of a measure, which the scatter of one record does not show.

Of a scene it is the largest difference from the limit at a step of zero that the included rigs have at their default
steps, from 115 to 210 rev/min (study `default_step`; forces and sliding work: against a quarter of the step), in
proportion to the step. Other rigs may have more: `resolution` judges their steps.
"""

from collections.abc import Callable
from math import hypot, nan
from re import fullmatch

from trackdyn.scene.scene import Scene

# Columns of a run (`measure.columns`), and their errors with a ring and without: relative, but for shares (points of a
# turn) and phases (turns).
ERRORS = {
    r"(rms|sd|mean)(_whole)?_g": (1e-3, 1e-3),
    r"line_g(_binfree)?": (1e-4, 2e-3),
    r"line_hz(_binfree)?": (0.0, 0.0),  # the speed's own
    r"high_frequency_g": (2e-3, 3e-3),
    r"(left|right|ring)_share_pct": (0.02, 0.05),
    r"(left|right|ring)_phase_(start|end)": (2e-4, 5e-4),
    r"(left|right|ring)_(rms|sd|rms_contact)_n": (5e-4, 5e-3),
    r"(left|right|ring)_peak_n": (5e-3, 2.6e-2),
    r"(teeth|ring)_sliding_j": (2e-3, 1e-2),
}
JUDGED = ("semi_implicit", "rk4")  # methods: a linearly implicit step is coarse on purpose
ABSOLUTE = ("_share_pct", "_phase_start", "_phase_end")


def whole_errors(scene: Scene) -> Callable[[str, float, float], float]:
    """Function of a column of a run of a scene, its value and standard error: the error with what the step adds.

    NaN where the standard error or what the step adds is not known; a value of zero has the standard error.
    """
    times = 0.0 if scene.chain == "belt" else scene.time_step / scene.with_(step=None).time_step
    times = times if scene.chain == "belt" or scene.integrator in JUDGED else nan

    def whole(column: str, value: float, error: float) -> float:
        of_step = next((errors for name, errors in ERRORS.items() if fullmatch(name, column)), (nan, nan))
        size = 1.0 if column.endswith(ABSOLUTE) else abs(value)
        return hypot(error, times * of_step[scene.ring_radius is None] * size) if value else error

    return whole
