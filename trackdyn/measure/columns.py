"""What the columns of ``metrics.csv`` are: a data dictionary after the Table Schema of Frictionless Data."""

from collections.abc import Iterable

from trackdyn.errors import InputError

SETTING = "a setting of the run"
CHECK = "the largest value of a check over the record, no estimate of a mean"
REVOLUTIONS = "over revolutions of the loop"

# column: type, unit, description, and the column of its standard error or why it has none; errors themselves have
# neither
COLUMNS = {
    "run": ("string", "", "name of the run: a record, meshing/, ring/ or coarse/ and what it varies", SETTING),
    "rpm": ("number", "rev/min", "speed of the motor", SETTING),
    "ring_radius_m": ("number", "m", "radius of the rubber ring; empty: no ring", SETTING),
    "fidelity": ("string", "", "space, chain, tooth contact and integrator of the run", SETTING),
    "step_s": ("number", "s", "time step", SETTING),
    "simulated_s": ("number", "s", "length of the record", SETTING),
    "wall_s": ("number", "s", "wall time of the run", "measured once, on a machine that may do other work"),
    "rms_g": ("number", "g", "root mean square of the sensor's y acceleration (Eq. 40)", "rms_error_g"),
    "sd_g": ("number", "g", "standard deviation of the sensor's y acceleration", "sd_error_g"),
    "rms_whole_g": ("number", "g", "root mean square over whole revolutions of the loop", "rms_whole_error_g"),
    "sd_whole_g": ("number", "g", "standard deviation over whole revolutions of the loop", "sd_whole_error_g"),
    "line_hz": ("number", "Hz", "frequency of the highest line of the FFT", "line_error_hz"),
    "line_g": ("number", "g", "amplitude of the highest line of the FFT", "line_error_g"),
    "line_hz_binfree": (
        "number",
        "Hz",
        "frequency of the main line, free of the picket fence",
        "line_error_hz_binfree",
    ),
    "line_g_binfree": ("number", "g", "amplitude of the main line, free of the picket fence", "line_error_g_binfree"),
    "rms_error_g": ("number", "g", f"standard error of the root mean square {REVOLUTIONS}", None),
    "sd_error_g": ("number", "g", f"standard error of the standard deviation {REVOLUTIONS}", None),
    "rms_whole_error_g": (
        "number",
        "g",
        f"standard error of the root mean square of whole revolutions, {REVOLUTIONS}",
        None,
    ),
    "sd_whole_error_g": (
        "number",
        "g",
        f"standard error of the standard deviation of whole revolutions, {REVOLUTIONS}",
        None,
    ),
    "line_error_hz": (
        "number",
        "Hz",
        "standard uncertainty of a frequency that is known to the width of a bin: width over root 12",
        None,
    ),
    "line_error_g": (
        "number",
        "g",
        f"standard error of the amplitude of the highest line {REVOLUTIONS}, for a record that begins "
        "at the same place of a revolution",
        None,
    ),
    "line_error_hz_binfree": (
        "number",
        "Hz",
        f"standard error of the bin-free frequency {REVOLUTIONS}; empty for fewer than three",
        None,
    ),
    "line_error_g_binfree": ("number", "g", f"standard error of the bin-free amplitude {REVOLUTIONS}", None),
    "high_frequency_g": ("number", "g", "root mean square of the content at and above 20 Hz", "high_frequency_error_g"),
    "high_frequency_error_g": ("number", "g", f"standard error of the content at and above 20 Hz {REVOLUTIONS}", None),
    "loop_gap_max_m": ("number", "m", "largest distance of the two ends of the loop after projection", CHECK),
    "gap_before_projection_m": ("number", "m", "largest distance of the two ends that a step opens", CHECK),
    "velocity_gap_m_s": ("number", "m/s", "largest velocity of the two ends relative to each other", CHECK),
    "energy_residual": (
        "number",
        "1",
        "open part of the account of work over the work of the sprocket",
        "what the step leaves open in this very record, no estimate of a mean",
    ),
    "clipped_samples": ("integer", "1", "samples that the range of the sensor cut", "a count in this very record"),
    "passages": ("integer", "1", "complete passages of connectors over the sprocket", "a count in this very record"),
}
PLACES = {"left": "the left arc", "right": "the right arc", "ring": "a link on the ring"}
PASSAGES = "by batch means over passages"
OF_A_SIDE = {
    "share_pct": ("%", "time in contact of {}, of a sprocket turn, mean over passages", "share_error_pct"),
    "share_error_pct": ("%", f"standard error of the time in contact of {{}} {PASSAGES}", None),
    "rms_n": ("N", "root mean square of the normal force on {} over the run", "rms_error_n"),
    "rms_error_n": ("N", f"standard error of the root mean square of the force on {{}} {PASSAGES}", None),
    "sd_n": ("N", "standard deviation of the normal force on {} over the run", "sd_error_n"),
    "sd_error_n": ("N", f"standard error of the standard deviation of the force on {{}} {PASSAGES}", None),
    "rms_contact_n": (
        "N",
        "root mean square of the normal force on {} over the time in contact",
        "rms_contact_error_n",
    ),
    "rms_contact_error_n": ("N", f"standard error of the root mean square in contact of {{}} {PASSAGES}", None),
    "peak_n": ("N", "largest normal force on {} in a passage, mean over passages", "peak_error_n"),
    "peak_error_n": ("N", f"standard error of the mean largest force on {{}} {PASSAGES}", None),
    "peak_largest_n": (
        "N",
        "largest normal force on {} in all passages",
        "the largest of a sample, which grows with the record; compare peak_n",
    ),
    "phase_start": ("turns", "first touch of {} after the first contact of the passage, mean", "phase_start_error"),
    "phase_start_error": ("turns", f"standard error of the first touch of {{}} {PASSAGES}", None),
    "phase_end": ("turns", "last release of {} after the first contact of the passage, mean", "phase_end_error"),
    "phase_end_error": ("turns", f"standard error of the last release of {{}} {PASSAGES}", None),
}


def error_of(name: str) -> str | None:
    """Column with the standard error of a column, or the reason why it has none; None for an error itself.

    Raises
    ------
    InputError
        For a column that is not described here.
    """
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


def table_schema(columns: Iterable[str]) -> dict:
    """Table Schema of some columns of ``metrics.csv``, in their order: name, type, unit, description of each.

    ``standardError`` is the column with the standard error, or says why there is none; errors have no such entry.

    Raises
    ------
    InputError
        For a column that is not described here.
    """
    fields = [_field(name) for name in columns]
    return {
        "$schema": "https://datapackage.org/profiles/2.0/tableschema.json",
        "fields": fields,
        "missingValues": [""],
        "primaryKey": ["run"],
    }
