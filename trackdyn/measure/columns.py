"""The dictionary of columns: type, unit and meaning of those of published CSV files, as a Table Schema of Frictionless
Data, and words and units of all columns that tables, page and figures show.
"""

import json
import re
from collections.abc import Iterable

from trackdyn.errors import InputError

SETTING = "a setting of the run"
CHECK = "the largest value of a check over the record, no estimate of a mean"
REVOLUTIONS = "over revolutions of the loop"

# column: type, unit, description, and the column of its standard error or why it has none; errors themselves have
# neither
COLUMNS: dict[str, tuple[str, str, str, str | None]] = {
    "run": ("string", "", "name of the run: a record, meshing/, ring/ or coarse/ and what it varies", SETTING),
    "rpm": ("number", "rev/min", "speed of the motor that is asked for", SETTING),
    "rpm_made": ("number", "rev/min", "speed that the motor made, mean over the record", "a mean of all samples"),
    "rpm_drift_pct": ("number", "%", "largest difference of the speeds made in the turns of the sprocket, % of their "
                      "mean", CHECK),
    "ring_radius_m": ("number", "m", "radius of the rubber ring; empty: no ring", SETTING),
    "fidelity": ("string", "", "space, chain, tooth contact and integrator of the run", SETTING),
    "step_s": ("number", "s", "time step", SETTING),
    "simulated_s": ("number", "s", "length of the record", SETTING),
    "rms_g": ("number", "g", "root mean square of the sensor's y acceleration (Eq. 40)", "rms_error_g"),
    "sd_g": ("number", "g", "standard deviation of the sensor's y acceleration", "sd_error_g"),
    "rms_whole_g": ("number", "g", "root mean square over whole revolutions of the loop", "rms_whole_error_g"),
    "sd_whole_g": ("number", "g", "standard deviation over whole revolutions of the loop", "sd_whole_error_g"),
    "line_hz": ("number", "Hz", "frequency of the dominant peak, the highest bin of the FFT", "line_error_hz"),
    "line_g": ("number", "g", "amplitude of the dominant peak, the highest bin of the FFT", "line_error_g"),
    "line_hz_binfree": ("number", "Hz", "frequency of the dominant peak, interpolated between bins",
                        "line_error_hz_binfree"),
    "line_g_binfree": ("number", "g", "amplitude of the dominant peak, interpolated between bins",
                       "line_error_g_binfree"),
    "line_error_hz": ("number", "Hz", "standard uncertainty of the frequency of a bin: its width over root 12", None),
    "line_error_g": (
        "number",
        "g",
        f"standard error of the amplitude of the highest line {REVOLUTIONS}, for a record that begins "
        "at the same phase of a revolution",
        None,
    ),
    "line_error_hz_binfree": (
        "number",
        "Hz",
        f"standard error of the bin-free frequency {REVOLUTIONS}; empty for fewer than three",
        None,
    ),
    "high_frequency_g": ("number", "g", "root mean square of the content at and above 20 Hz, over whole "
                         "revolutions of the loop", "high_frequency_error_g"),
    "loop_gap_max_m": ("number", "m", "largest distance of the two ends of the loop after projection", CHECK),
    "gap_before_projection_m": ("number", "m", "largest distance of the two ends that a step opens", CHECK),
    "velocity_gap_m_s": ("number", "m/s", "largest velocity of the two ends relative to each other", CHECK),
    "energy_residual": ("number", "1", "residual of the energy balance, relative to the work of the sprocket",
                        "the residual of this record, no estimate of a mean"),
    "resolved": ("string", "", "whether the step resolves the contacts: yes, no, or not judged",
                 "a verdict on this record"),
    "clipped_samples": ("integer", "1", "samples clipped at the range of the sensor", "a count in this record"),
    "passages": ("integer", "1", "complete passages of connectors over the sprocket", "a count in this record"),
}  # fmt: skip
COLUMNS |= {
    error: ("number", unit, f"standard error {REVOLUTIONS}: {text}", None)
    for _, unit, text, error in COLUMNS.values()
    if error and " " not in error and error not in COLUMNS
}
PLACES = {"left": "the left arc", "right": "the right arc", "ring": "a link on the ring"}
PASSAGES = "by batch means over passages"
OF_A_SIDE: dict[str, tuple[str, str, str | None]] = {
    "share_pct": ("%", "contact duration of {}, % of a sprocket turn, mean over passages", "share_error_pct"),
    "rms_n": ("N", "root mean square of the normal force on {} over the run", "rms_error_n"),
    "sd_n": ("N", "standard deviation of the normal force on {} over the run", "sd_error_n"),
    "rms_contact_n": ("N", "root mean square of the normal force on {} over the time in contact",
                      "rms_contact_error_n"),
    "peak_n": ("N", "largest normal force on {} in a passage, mean over passages", "peak_error_n"),
    "peak_largest_n": ("N", "largest normal force on {} in all passages",
                       "the largest of a sample, which grows with the record; compare peak_n"),
    "phase_start": ("turns", "first touch of {} after the first contact of the passage, mean", "phase_start_error"),
    "phase_end": ("turns", "last release of {} after the first contact of the passage, mean", "phase_end_error"),
}  # fmt: skip
OF_A_SIDE |= {
    error: (unit, f"standard error {PASSAGES}: {text}", None)
    for unit, text, error in OF_A_SIDE.values()
    if error and " " not in error
}

# other published tables: the columns that identify a row, then type, unit and description of every column
TABLES: dict[str, tuple[tuple[str, ...], dict[str, tuple[str, str, str]]]] = {
    "claims": (("rig", "id", "part"), {
        "rig": ("string", "", "name of the rig that is judged"),
        "id": ("string", "", "claim of the paper, C01 to C28"),
        "part": ("string", "", "letter of a claim in several statements, a to f; else empty"),
        "place": ("string", "", "figure, table or text of the paper that states it"),
        "claim": ("string", "", "what the paper states"),
        "printed": ("string", "", "value in the paper, by speed; ours: our bound for words without a number"),
        "measured": ("string", "", "value of the runs as text; claims_values.csv has its numbers one per row"),
        "unit": ("string", "", "unit of printed, measured and tolerance; 1: none"),
        "tolerance": ("number", "", "largest difference from printed that is shown, in unit; empty: no such rule"),
        "verdict": ("string", "", "shown, not shown, no test, or not comparable"),
        "speeds": ("string", "rev/min", "motor speeds at which it is judged"),
        "by_speed": ("boolean", "", "whether measured has one value per speed"),
        "fails_if": ("string", "", "result that would contradict the claim"),
        "reason": ("string", "", "reason of tolerance, verdict or missing data"),
    }),
    "claims_values": (("rig", "id", "part", "rpm", "reading"), {
        "rig": ("string", "", "name of the rig that is judged"),
        "id": ("string", "", "claim of the paper, C01 to C28"),
        "part": ("string", "", "letter of a claim in several statements, a to f; else empty"),
        "rpm": ("number", "rev/min", "motor speed of the value; empty: the value belongs to several speeds"),
        "reading": ("string", "", "which of several values at a speed: how the paper's words are read, least, largest, "
                                  "or a number from 1 in the order of claims.csv; empty: the only one"),
        "value": ("number", "", "value of the runs, in unit"),
        "standard_error": ("number", "", "standard error of value, in unit; empty: the claim reads no column of the "
                                         "long records, or the record is too short for one"),
        "unit": ("string", "", "unit of value, standard_error, printed and tolerance; 1: none"),
        "printed": ("number", "", "value or bound that it is compared with, in unit; empty: a trend"),
        "rule": ("string", "", "equal: within the tolerance; at_most, at_least: a bound; rising: larger than the value "
                               "at the speed before; no_test: listed only"),
        "tolerance": ("number", "", "largest difference from printed that is shown, in unit; empty: no such rule"),
        "distance": ("number", "1", "difference from printed in tolerances, at most 1 where met; for a bound 1 on the "
                                    "bound, 0 well inside; inf: never happens; empty: no distance"),
        "met": ("boolean", "", "whether this value is as claimed; empty: nothing is tested"),
        "verdict": ("string", "", "verdict of the statement, from all of its values"),
    }),
    "events": (("run", "event"), {
        "event": ("string", "", "event of a passage: first or last touch of a side, or its largest force by a reading"),
        "mean_s": ("number", "s", "time after the first contact of the passage, mean over passages; empty: never"),
        "sd_s": ("number", "s", "standard deviation of that time over passages; empty: in fewer than two"),
        "passages": ("integer", "1", "complete passages in which the event happens"),
        "area": ("number", "1", "area of the groove that is touched at a maximum, 1 to 10, the most frequent one"),
        "run": ("string", "", "name of the run: meshing/no_ring or meshing/ring"),
    }),
}  # fmt: skip

# endings of column names, and units that stand within one
UNITS = {
    "s_per_s": "s/s", "m_s2": "m/s2", "m_s": "m/s", "pct": "%", "rpm": "rev/min", "deg": "deg", "hz": "Hz", "mm": "mm",
    "mb": "MB", "us": "µs", "ms": "ms", "s": "s", "g": "g", "n": "N", "m": "m",
}  # fmt: skip
# a measure of the studies: its words, and the unit of an error in it
MEASURES = {
    "rms": ("RMS of the acceleration", "relative"),
    "sd": ("SD of the acceleration", "relative"),
    "line": ("amplitude of the dominant peak", "relative"),
    "high_frequency": ("RMS of the acceleration at and above 20 Hz", "relative"),
    "left_peak": ("mean peak force, left arc", "relative"),
    "right_peak": ("mean peak force, right arc", "relative"),
    "left_share": ("contact duration, left arc", "turns"),
    "right_share": ("contact duration, right arc", "turns"),
    "ring_share": ("contact duration, ring", "turns"),
    "loop_gap": ("largest closure error", "m"),
    "energy_residual": ("residual of the energy balance", "relative"),
    "all": ("every measure", "relative"),
}
# headings that the rule of the units does not say well
HEADINGS = {
    "work_j": "work (J)",
    "rpm": "motor speed (rev/min)",
    "speed_rpm": "motor speed (rev/min)",
    "wall_s_per_s": "wall time per simulated second (s)",
    "cpu_s_per_s": "CPU time per simulated second (s)",
    "step_s": "time step (s)",
    "error_pct": "error (% of the range)",
    "u_x": "direction u, x",
    "u_y": "direction u, y",
    "O_x_mm": "centre, x (mm)",
    "O_y_mm": "centre, y (mm)",
    "r_mm": "radius (mm)",
    "theta_deg": "half angle (deg)",
    "cpu_s": "CPU time (s)",
    "met": "tolerance met",
    "limit_error": "error of the limit",
    "expected_error": "predicted error bound",
    "duration_s": "recorded (s)",
    "loop_gap_m": "largest closure error (m)",
    "printed_in_the_paper": "published",
    "rows": "cases",
    "share_pct": "contact duration (% of a turn)",
    "phase_start": "first touch (turns)",
    "phase_end": "last touch (turns)",
    "rms_n": "RMS force (N)",
    "sd_n": "SD of the force (N)",
}
WORDS = {
    "rms": "RMS", "sd": "SD", "rk4": "Runge-Kutta, 4th order", "semi_implicit": "semi-implicit Euler",
    "papers": "paper's", "binfree": "bin-free",
}  # fmt: skip


def error_of(name: str) -> str | None:
    """Column of a column's standard error, or why it has none; None for an error, `InputError` if not described."""
    side, _, rest = name.partition("_")
    if name in COLUMNS:
        return COLUMNS[name][3]
    if side in PLACES and rest in OF_A_SIDE:
        error = OF_A_SIDE[rest][2]
        return f"{side}_{error}" if error in OF_A_SIDE else error
    if side in PLACES and rest == "areas":
        return "what was visited at all, no number"
    raise InputError(f"metrics: column {name} has no description; give it one in trackdyn/measure/columns.py")


def _field(name: str) -> dict:
    side, _, rest = name.partition("_")
    error = error_of(name)
    if name in COLUMNS:
        kind, unit, text = COLUMNS[name][:3]
    elif rest in OF_A_SIDE:
        kind, (unit, text) = "number", OF_A_SIDE[rest][:2]
    else:
        kind, unit, text = "string", "", "areas of the groove that {} visits, such as 2,3, or none"
    field = {"name": name, "type": kind, "unit": unit, "description": text.format(PLACES.get(side))}
    return field if error is None else field | {"standardError": error}


def table_schema(columns: Iterable[str], table: str = "metrics") -> dict:
    """Table Schema of a published CSV file: name, type, unit and description of each of its columns, in their order.

    ``table`` is the file's name without ``.csv``: ``metrics``, or one of ``TABLES``. In ``metrics``, ``standardError``
    is the column with the standard error, or says why there is none; errors have no such entry. Raises `InputError` for
    a column that is not described here.
    """
    key, described = TABLES.get(table, (("run",), {}))
    fields = []
    for name in columns:
        if table == "metrics":
            fields.append(_field(name))
        elif name in described:
            fields.append(dict(zip(("name", "type", "unit", "description"), (name, *described[name]), strict=True)))
        else:
            raise InputError(f"{table}: column {name} has no description; give it one in trackdyn/measure/columns.py")
    return {
        "$schema": "https://datapackage.org/profiles/2.0/tableschema.json",
        "fields": fields,
        "missingValues": [""],
        "primaryKey": list(key),
    }


def schema_text(columns: Iterable[str], table: str = "metrics") -> str:
    """`table_schema` as the JSON text that is written beside the file."""
    return json.dumps(table_schema(columns, table), indent=1, ensure_ascii=False) + "\n"


def words(name: str) -> str:
    """A name of the program in words: ``ten_arcs`` becomes ``ten arcs``."""
    return WORDS.get(name) or re.sub(r"\w+", lambda match: WORDS.get(match[0], match[0]), name.replace("_", " "))


def heading(column: str, change: bool = False) -> str:
    """Name of a column in words with its unit in brackets; ``change`` if measures of it are differences."""
    side, _, rest = column.partition("_")
    if column in HEADINGS:
        return HEADINGS[column]
    if side in PLACES and rest in HEADINGS:
        return f"{side}{' arc' * (side != 'ring')}, {HEADINGS[rest]}"
    if column in MEASURES:
        unit = "% of a turn" if column.endswith("share") else "%"
        return MEASURES[column][0] + (f" ({unit})" if change else "")
    for ending, unit in UNITS.items():
        before, separator, after = f"_{column}_".partition(f"_{ending}_")
        if separator:
            parts = (
                re.sub(rf"(^|_)({'|'.join(UNITS)})(?=_|$)", "", text.strip("_")).strip("_") for text in (before, after)
            )
            return f"{words(', '.join(filter(None, parts)))} ({unit})".lstrip()
    return words(column)


def groups(columns) -> list[tuple[str, int]]:
    """Head of a table in two lines: first words that three or more neighbours share (else ""), and how many do."""
    runs: list[tuple[str, int]] = []
    for column in columns:
        first = column.partition("_")[0]
        if runs and runs[-1][0] == first:
            runs[-1] = (first, runs[-1][1] + 1)
        else:
            runs.append((first, 1))
    return [group for first, n in runs for group in ([(first, n)] if n > 2 else [("", 1)] * n)]
