"""Reference solutions: RK4 at a fine step; error bars from two other ways to the same motion.

The first is the semi-implicit step extrapolated to a step of zero. The second is Exudyn, another formulation in another
code, extrapolated from its two finest steps. The bar of a quantity is the largest of their distances from the
reference and of that of RK4 at the next coarser step.
"""

import json
import sys

import numpy as np
from run_exudyn import answer as exudyn
from run_trackdyn import answer

from laboratory.benchmark.problems import FOLDER, NAMES, read_problem
from laboratory.benchmark.score import answer_statistics, apart, series_of
from trackdyn.files import write_text

# s: fine and next step of RK4, two of the semi-implicit one, two of Exudyn; order of Exudyn's error (1 through impacts)
STEPS = {
    "free_chain": ((5e-5, 1e-4), (2e-5, 1e-5), (5e-4, 2.5e-4), 2),
    "ring": ((2e-5, 5e-5), (2e-5, 1e-5), (2e-4, 1e-4), 2),
    "teeth": ((2e-6, 5e-6), (4e-6, 2e-6), (5e-5, 2.5e-5), 1),
}
DIGITS = {"time_s": 3, "force_x_n": 4, "force_y_n": 4, "idler_rad_s": 9, "road_wheel_rad_s": 9}


def measured(found: tuple, name: str) -> tuple[dict, dict]:
    """Series and statistics of an answer."""
    series, contacts = found[:2]
    toothed = "sprocket" in read_problem(name)
    return series_of(series, read_problem(name)["report"]), answer_statistics(
        series, contacts if toothed else None, name
    )


def extrapolated(coarse: tuple, fine: tuple, order: int, ratio: float = 2.0) -> tuple[dict, dict]:
    """Series and statistics at a step of zero, from two steps whose quotient is ``ratio``."""
    lean = 1.0 / (ratio**order - 1.0)
    return tuple({key: f[key] + lean * (f[key] - c[key]) for key in f} for c, f in zip(coarse, fine, strict=True))


def make(name: str, folder=FOLDER) -> dict:
    """Write the reference of a problem; the distances that its bars are made of, by way."""
    rk4, semi, peer, order = STEPS[name]
    runs = [answer(name, "rk4", step) for step in rk4]
    series = runs[0][0]
    right, values = measured(runs[0], name)
    ways = {
        "rk4": measured(runs[1], name),
        "semi_implicit": extrapolated(*(measured(answer(name, "semi_implicit", h), name) for h in semi), 1),
        "exudyn": extrapolated(*(measured(exudyn(name, "generalized_alpha", h), name) for h in peer), order),
    }
    off = {
        way: {"series": {key: apart(found[key], right[key]) for key in right},
              "statistics": {key: abs(numbers[key] / values[key] - 1.0) for key in values}}
        for way, (found, numbers) in ways.items()
    }  # fmt: skip

    def bar(kind, key):
        return float(f"{max(one[kind][key] for one in off.values()):.2g}")

    said = {
        "problem": name,
        "series": {key: bar("series", key) for key in right},
        "statistics": {key: {"value": values[key], "bar": bar("statistics", key)} for key in values},
        "distances": off,
    }
    names = [key for key in series if key in DIGITS or key in ("x_m", "y_m")]
    lines = [",".join(names)]
    lines += [
        ",".join(f"{v:.{DIGITS.get(k, 13)}f}" for k, v in zip(names, row, strict=True))
        for row in np.column_stack([series[key] for key in names])
    ]
    write_text(folder / f"{name}_reference.csv", "\n".join(lines) + "\n")
    write_text(folder / f"{name}_reference.json", json.dumps(said, indent=1) + "\n")
    return off


if __name__ == "__main__":
    for each in sys.argv[1:] or NAMES:
        print(each, json.dumps(make(each), indent=1), flush=True)
