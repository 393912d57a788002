"""Names of columns and cells as a person reads them: words, units, three significant digits."""

import re

# endings of column names, and units that stand within one
UNITS = {
    "s_per_s": "s/s", "pct": "%", "rpm": "rev/min", "deg": "deg", "hz": "Hz", "mm": "mm", "mb": "MB", "us": "µs",
    "ms": "ms", "s": "s", "g": "g", "n": "N", "m": "m",
}  # fmt: skip
# a measure of the studies: its words, and the unit of an error in it
MEASURES = {
    "state_m": ("place of the chain after a short window", "m"),
    "rms": ("RMS of the acceleration", "relative"),
    "sd": ("SD of the acceleration", "relative"),
    "line": ("main line of the spectrum", "relative"),
    "left_peak": ("mean peak force, left arc", "relative"),
    "left_share": ("time in contact, left arc", "turns"),
    "right_share": ("time in contact, right arc", "turns"),
    "ring_share": ("time in contact, ring", "turns"),
    "loop_gap": ("largest gap of the loop", "m"),
    "energy_residual": ("open part of the account of work", "relative"),
    "all": ("every measure", "relative"),
}
# what the rule of the units does not say well
COLUMNS = {
    "work_j": "work (J)",
    "rpm": "motor speed (rev/min)",
    "speed_rpm": "motor speed (rev/min)",
    "sensor_record": "record of the sensor",
    "wall_s_per_s": "wall time of a simulated second (s)",
    "cpu_s_per_s": "processor time of a simulated second (s)",
    "step_s": "time step (s)",
    "error_pct": "error (% of the range)",
    "u_x": "direction u, x",
    "u_y": "direction u, y",
    "O_x_mm": "centre, x (mm)",
    "O_y_mm": "centre, y (mm)",
    "r_mm": "radius (mm)",
    "theta_deg": "half its angle (deg)",
    "wall_s": "wall time (s)",
    "cpu_s": "processor time (s)",
    "achieved_error": "error it had",
    "met": "kept",
    "rms_m_s2": "RMS (m/s2)",
    "limit_error": "error of the limit",
    "expected_error": "error expected at most",
    "duration_s": "recorded (s)",
    "loop_gap_m": "largest gap of the loop (m)",
    "printed_in_the_paper": "printed in the paper",
    "rows": "cases",
}
WORDS = {
    "rms": "RMS", "sd": "SD", "rk4": "Runge-Kutta, 4th order", "semi_implicit": "semi-implicit Euler",
    "papers": "paper's",
}  # fmt: skip
LARGE, SMALL = 1e5, 1e-4  # beyond them a number has an exponent


def words(name: str) -> str:
    """A name of the program in words: ``ten_arcs`` becomes ``ten arcs``."""
    return WORDS.get(name) or re.sub(r"\w+", lambda part: WORDS.get(part[0], part[0]), name.replace("_", " "))


def heading(column: str, change: bool = False) -> str:
    """Name of a column in words with its unit in brackets; ``change`` if measures of it are differences."""
    if column in COLUMNS:
        return COLUMNS[column]
    if column in MEASURES:
        unit = "% of a turn" if column.endswith("share") else "%"
        return MEASURES[column][0] + (f" ({unit})" if change else "")
    for ending, unit in UNITS.items():
        before, found, after = f"{column}_".partition(f"_{ending}_")
        if found:
            return f"{words(', '.join(filter(None, (before, after.strip('_')))))} ({unit})"
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Head of a table in two lines: first words that three or more neighbours share, each with its number of columns.

    Columns of no group stand alone, under an empty word.
    """
    found: list[tuple[str, int]] = []
    for column in columns:
        first = column.partition("_")[0]
        if found and found[-1][0] == first:
            found[-1] = (first, found[-1][1] + 1)
        else:
            found.append((first, 1))
    return [part for first, n in found for part in ([(first, n)] if n > 2 else [("", 1)] * n)]


def cell(value, digits: int = 3) -> str:
    """A cell as text: three significant digits, a dash for nothing."""
    if value is None or value == "":
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    if value and not SMALL <= abs(value) < LARGE:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        text = f"{mantissa}e{int(exponent)}"
    else:
        # whole numbers keep their digits, and zeros that were measured stay
        text = f"{value:.0f}" if abs(value) >= 10 ** (digits - 1) or value == 0 else f"{value:#.{digits}g}"
    return text.replace("-", "\N{MINUS SIGN}")


def change(value: float | None) -> str:
    """A difference in percent: two decimals, or three digits of a large one; a dash for nothing."""
    if value is None:
        return "–"
    text = f"{value:+.2f}" if abs(value) < 10 else f"{value:+.3g}" if abs(value) < 1000 else f"{value:+.0f}"
    return "0" if float(text) == 0 else text.replace("-", "\N{MINUS SIGN}")


def span(text: str) -> str:
    """The numbers of a text, three digits each: one, two, or the least and the largest of more."""
    text = re.sub(r" at \d+(?: rpm)?", "", text)  # the speeds that the numbers are of
    found = sorted({float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)})
    if not found:
        return text
    ends = found if len(found) < 3 else [found[0], found[-1]]
    return " to ".join(dict.fromkeys(cell(value) for value in ends))
