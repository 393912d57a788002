"""Printed numbers that figures and tables compare with their own, each with its source.

Accelerations are in g, the unit of the sensor, differences and shares in percent, as printed. Cells of Tables 1 to 4
and curves are not among them: no missing number may be invented. A reader may fill in Table 3 (`load_cells`).
"""

from itertools import product
from math import inf
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError, shown
from trackdyn.sweeps.design import read_table

# names of a sensor's record: synthetic, measured, or none there
SENSORS = {True: "synthetic sensor", False: "sensor", None: "no sensor record"}
SPEEDS_RPM = (115, 150, 180, 210)


def _by_speed(*values: float) -> dict[int, float]:
    return dict(zip(SPEEDS_RPM, values, strict=True))


# The rig
TRANSMISSION_RATIO = 5.57  # 1; Sect. 5
RECORD_DURATION = 90.0  # s; Sect. 5

# Section 5: verification
LOOP_GAP = 1.1023e-10  # m; Sect. 5, text on Fig. 15
DISPLACEMENT_DIFFERENCE = 6.03  # %; Sect. 5, text on Fig. 14
DIFFERENCES = {  # %; Sect. 5, text on Table 3
    "rms": _by_speed(4.96, 8.53, 12.73, 7.02), "sd": _by_speed(5.14, 8.40, 12.09, 8.05),
}  # fmt: skip
LINES = {  # dominant peaks: Hz, g, marker; Sect. 5, text on Fig. 18
    "simulation": (_by_speed(0.122, 0.167, 0.200, 0.233), _by_speed(0.793, 1.174, 1.167, 1.162), "D"),
    "experiment": (_by_speed(0.131, 0.176, 0.2090, 0.253), _by_speed(1.083, 1.1200, 1.1720, 0.7698), "X"),
}

# Section 6.1: one engagement at 115 rpm, times as printed (their zero is not given), s
EVENTS_WITHOUT_RING = {  # text on Figs. 19 and 20
    "about to engage": 4.20, "first contact of the right arc": 4.29, "first contact of the left arc": 4.29,
    "left maximum": 4.46, "right maximum": 5.36, "right contact gone": 5.58, "out of engagement": 5.60,
}  # fmt: skip
EVENTS_WITH_RING = {  # text on Figs. 21 and 22
    "ring first touched": 4.05, "ring maximum": 4.27, "first contact of the left arc": 5.30, "left maximum": 5.47,
    "ring left": 5.48, "out of engagement": 5.56,
}  # fmt: skip

# Section 6.2: radius of the ring
RADIUS_WITHOUT_RIGHT_CONTACT = 0.305  # m; Sect. 6.2, text on Fig. 23: from there on no right-arc contact
RADIUS_CHOSEN = 0.308  # m; Sect. 6, conclusion
RADIUS_OF_STEADY_LEFT_SHARE = 0.307  # m; Sect. 6.2, text on Fig. 24
STEADY_LEFT_SHARE = 10.0  # %; Sect. 6.2, text on Fig. 24: of a sprocket turn


CELLS = ("rms_simulation_g", "rms_experiment_g", "sd_simulation_g", "sd_experiment_g")  # of Table 3, by motor speed
# points by which these may miss a printed difference: two cells near 1 g with two decimals, 0.005 g off each
ROUNDED_DIFFERENCE = 1.1


def load_cells(path: Path | str) -> pd.DataFrame:
    """Read the article's Table 3, g, by motor speed (rev/min); NaN where a reader has not filled in a cell."""
    table = read_table(path)
    if [*table.columns] != ["rpm", *CELLS] or table["rpm"].tolist() != [*map(str, SPEEDS_RPM)]:
        raise InputError(f"{path}: its cells are not those of config/article.csv in the repository; change values only")
    text = table.set_index(pd.Index(SPEEDS_RPM, dtype=float))[[*CELLS]]
    cells = text.apply(pd.to_numeric, errors="coerce")
    for rpm, name in product(cells.index, CELLS):
        if text.at[rpm, name] and not 0 < cells.at[rpm, name] < inf:
            problem = f"{rpm:g} rpm, {name} = {shown(text.at[rpm, name])}"
            raise InputError(f"{path}: {problem}: must be a number above 0, or empty")
    for name, known in DIFFERENCES.items():
        differences = value_difference(cells[f"{name}_simulation_g"], cells[f"{name}_experiment_g"])
        for rpm, difference in differences[(differences - pd.Series(known)).abs() > ROUNDED_DIFFERENCE].items():
            pair = f"{rpm:g} rpm, {name}_simulation_g and {name}_experiment_g"
            raise InputError(f"{path}: {pair} differ by {difference:.3g} %; printed is {known[rpm]:g} %, correct them")
    return cells


def value_difference(simulated, measured):
    """Return the paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100 * np.abs(simulated - measured) / measured


def peaks(rpm: float) -> list[tuple[str, float, float, str]]:
    """Return the printed dominant peaks at a motor speed: label, frequency (Hz), amplitude (g), marker."""
    return [(f"printed, {source}", hz[rpm], g[rpm], mark) for source, (hz, g, mark) in LINES.items() if rpm in hz]
