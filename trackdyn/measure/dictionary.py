"""What the columns of ``metrics.csv`` are: a data dictionary after the Table Schema of Frictionless Data."""

from collections.abc import Iterable

from trackdyn.errors import InputError
from trackdyn.measure.meshing import SIDES

# column: type, unit, description
COLUMNS = {
    "run": ("string", "", "name of the run: a record, meshing/, ring/ or coarse/ and what it varies"),
    "rpm": ("number", "rev/min", "speed of the motor"),
    "ring_radius_m": ("number", "m", "radius of the rubber ring; empty: no ring"),
    "fidelity": ("string", "", "space, chain, tooth contact and integrator of the run"),
    "step_s": ("number", "s", "time step"),
    "simulated_s": ("number", "s", "length of the record"),
    "wall_s": ("number", "s", "wall time of the run"),
    "rms_g": ("number", "g", "root mean square of the sensor's y acceleration (Eq. 40)"),
    "sd_g": ("number", "g", "standard deviation of the sensor's y acceleration"),
    "rms_whole_g": ("number", "g", "root mean square over whole revolutions of the loop"),
    "sd_whole_g": ("number", "g", "standard deviation over whole revolutions of the loop"),
    "line_hz": ("number", "Hz", "frequency of the highest line of the FFT"),
    "line_g": ("number", "g", "amplitude of the highest line of the FFT"),
    "line_hz_binfree": ("number", "Hz", "frequency of the main line, free of the picket fence"),
    "line_g_binfree": ("number", "g", "amplitude of the main line, free of the picket fence"),
    "rms_error_g": ("number", "g", "standard error of the root mean square over revolutions of the loop"),
    "sd_error_g": ("number", "g", "standard error of the standard deviation over revolutions of the loop"),
    "high_frequency_g": ("number", "g", "root mean square of the content at and above 20 Hz"),
    "loop_gap_max_m": ("number", "m", "largest distance of the two ends of the loop after projection"),
    "gap_before_projection_m": ("number", "m", "largest distance of the two ends that a step opens"),
    "velocity_gap_m_s": ("number", "m/s", "largest velocity of the two ends relative to each other"),
    "energy_residual": ("number", "1", "open part of the account of work over the work of the sprocket"),
    "clipped_samples": ("integer", "1", "samples that the range of the sensor cut"),
    "passages": ("integer", "1", "complete passages of connectors over the sprocket"),
}
PLACES = dict(zip(SIDES, ("the left arc", "the right arc", "a link on the ring"), strict=True))
OF_A_SIDE = {
    "share_pct": ("%", "time in contact of {}, of a sprocket turn, mean over passages"),
    "share_error_pct": ("%", "standard error of the time in contact of {} over passages"),
    "rms_n": ("N", "root mean square of the normal force on {} over the run"),
    "rms_error_n": ("N", "standard error of the root mean square of the force on {} over passages"),
    "sd_n": ("N", "standard deviation of the normal force on {} over the run"),
    "sd_error_n": ("N", "standard error of the standard deviation of the force on {} over passages"),
    "rms_contact_n": ("N", "root mean square of the normal force on {} over the time in contact"),
    "peak_n": ("N", "largest normal force on {} in a passage, mean over passages"),
    "phase_start": ("turns", "first touch of {} after the first contact of the passage, mean"),
    "phase_end": ("turns", "last release of {} after the first contact of the passage, mean"),
}


def _field(name: str) -> dict:
    side, _, rest = name.partition("_")
    if name in COLUMNS:
        kind, unit, text = COLUMNS[name]
    elif side in PLACES and rest in OF_A_SIDE:
        kind, (unit, text) = "number", OF_A_SIDE[rest]
    elif side in PLACES and rest == "areas":
        kind, unit, text = "string", "", "areas of the groove that {} visits, such as 2,3, or none"
    else:
        raise InputError(f"metrics: column {name} has no description; give it one in trackdyn/measure/dictionary.py")
    return {"name": name, "type": kind, "unit": unit, "description": text.format(PLACES.get(side))}


def table_schema(columns: Iterable[str]) -> dict:
    """Table Schema of some columns of ``metrics.csv``, in their order: name, type, unit and description of each.

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
