"""One row of numbers a run: the columns of ``metrics.csv``. A new metric is added here; no simulation depends on it."""

from collections.abc import Callable
from itertools import pairwise
from math import hypot, nan, sqrt
from re import fullmatch

import numpy as np

from trackdyn.measure.catalogue import BY_COLUMN
from trackdyn.measure.columns import SHOWN, described
from trackdyn.measure.contacts import LONGEST_CONTACT, PASSAGE
from trackdyn.measure.sensor import readings, sense
from trackdyn.measure.spectra import LEAST_PERIODS, rms
from trackdyn.measure.taken import Sensed, meshing_summary, sensor_metrics
from trackdyn.measure.uncertainty import NAN, STEP_ERRORS, batches_of, student, turn_edges
from trackdyn.measure.whole_loop import mobilised_friction, work_measures
from trackdyn.scene.scene import Scene
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording

OF_THE_EARTH = 0.005  # share by which gravity differs between poles and equator

# Turns of which it can be told that they drift, and how surely their slope is to be none of scatter.
LEAST_DRIFTING, SLOPE_CONFIDENCE = 4, 0.8
JUDGED_METHODS = ("semi_implicit", "rk4")  # methods: a linearly implicit step is coarse on purpose


def sensor_row(recording: Recording, sensor: str | int = 0) -> dict:
    """Columns of a run about one sensor."""
    signal = sense(recording, sensor=sensor)
    measured = sensor_metrics(signal.ay, recording.rate, recording.periods.loop_hz)
    return measured | {"clipped_samples": signal.clipped}


def run_metrics(name: str, recording: Recording) -> dict:
    """The row of a run: what ran, what its first sensor and the contacts show."""
    scene, sensed = recording.scene, sensor_row(recording)
    choices = (scene.fidelity[name].setting for name in ("space", "chain", "tooth_contact", "integrator"))
    clipped = sensed.pop("clipped_samples")
    gaps = recording.cut.max(axis=0) if len(recording.cut) else (NAN, NAN)
    friction, friction_error, _ = mobilised_friction(recording)
    return {
        "run": name,
        "rpm": scene.motor_rpm,
        "ring_radius_m": NAN if scene.ring_radius is None else scene.ring_radius,
        "fidelity": "/".join(choice for choice in choices if choice != "none"),
        "step_s": scene.time_step,
        "simulated_s": recording.seconds,
        **sensed,
        "loop_gap_max_m": float(recording.gap.max()),
        "gap_before_projection_m": float(gaps[0]),
        "velocity_gap_m_s": float(gaps[1]),
        "energy_residual": energy_residual(recording),
        "resolved": recording.resolution.state,
        "clipped_samples": clipped,
        "settled_tension_n": recording.layout.settled_tension_n,
        **meshing_summary(recording),
        **work_measures(recording),
        "mobilised_friction": friction,
        "mobilised_friction_error": friction_error,
    }


def shown_measures(recording: Recording) -> list[dict]:
    """List the measures that a run prints: ``name``, ``measure``, ``value``, ``error``, ``half_width``, ``unit``.

    The standard error and half of the 95 % interval have scatter and step in them. They are None where they are not
    known; measures that are NaN are left out. Of a rig with several sensors a row
    also has the name of its ``sensor``, empty for what is not a sensor's.
    """
    rows, row, whole = [], run_metrics("", recording), whole_errors(recording.scene)
    names, degrees = list(recording.scene.rig.sensors), _degrees(recording, int(row["passages"]))
    several = {name: sensor_row(recording, name) for name in names} if len(names) > 1 else {}
    for name in SHOWN:
        _, unit, text, its_error = described(name)
        sensed = {sensor: columns for sensor, columns in several.items() if name in columns}
        for sensor, columns in (sensed or {"": row}).items():
            value, error = columns[name], columns.get(its_error, NAN)
            if value == value:
                half_width = whole(name, value, student(degrees(name)) * error if error else error)
                entry = {"name": name, "measure": text, "value": value}
                errors = {"error": whole(name, value, error), "half_width": half_width}
                entry |= {kind: None if known != known else known for kind, known in errors.items()}
                entry |= {"unit": "" if unit == "1" else unit}
                rows.append(entry | ({"sensor": sensor} if several else {}))
    return rows


def _degrees(recording: Recording, passages: int) -> Callable[[str], int]:
    """Function of a column of a run: degrees of freedom of its standard error, over turns or batches of passages."""
    sensed = Sensed(np.zeros(len(recording.time)), recording.rate, recording.periods.loop_hz)
    whole = int(recording.seconds / recording.periods.passage + 1e-6) if recording.periods.loop_hz else 0

    def degrees(column: str) -> int:
        measure = BY_COLUMN.get(column)
        if measure and measure.sensed:
            return sensed.degrees(column)
        return batches_of(passages if measure and measure.visits else whole)[1] - 1

    return degrees


def whole_errors(scene: Scene) -> Callable[[str, float, float], float]:
    """Function of a column of a run of a scene, its value and standard error: the error with what the step adds.

    Of half of a 95 % interval it is this with what the step adds: the largest known. That is in proportion to the step.
    Other rigs may have more than the included ones: `step_check` judges their steps.
    NaN where the standard error or what the step adds is not known; a value of zero has the standard error.
    """
    times = 0.0 if scene.chain == "belt" else scene.time_step / scene.with_(step=None).time_step
    times = times if scene.chain == "belt" or scene.integrator in JUDGED_METHODS else nan

    def whole(column: str, value: float, error: float) -> float:
        of_step = next((errors for name, errors in STEP_ERRORS.items() if fullmatch(name, column)), (nan, nan))
        size = BY_COLUMN[column].size(value) if column in BY_COLUMN else abs(value)
        return hypot(error, times * of_step[scene.ring_radius is None] * size) if value else error

    return whole


def needed_lengths(recording: Recording) -> dict[str, float]:
    """Name what the recording is too short for, with the length (s) that holds it wherever the record begins."""
    periods = recording.periods
    needed = {"dominant peak and standard errors": LEAST_PERIODS * periods.loop}
    if recording.scene.contact_log:
        passage = periods.loop + (2 * LONGEST_CONTACT + PASSAGE) * periods.turn
        needed["contacts of the recorded pitches"] = passage
    return {measure: seconds for measure, seconds in needed.items() if recording.seconds < seconds}


def remarks(recording: Recording) -> list[str]:
    """Sentences that belong to the numbers of a run.

    On accelerations beyond the range of a sensor; on a start that has not died away; on the unit g of a rig that is not
    on the earth.
    """
    scene = recording.scene
    count = 1 if scene.every_link else len(recording.sensors)
    sentences = list(filter(None, (_range_sentence(recording, sensor) for sensor in range(count))))
    sentences += filter(None, (_drift_sentence(recording, sensor) for sensor in range(len(recording.sensors))))
    gravity = scene.rig.gravity
    if gravity and abs(gravity / 9.81 - 1) >= OF_THE_EARTH:
        sentences.append(f"1 g is the rig's gravity of {gravity:g} m/s2; a sensor shows multiples of 9.81 m/s2")
    return sentences


def _range_sentence(recording: Recording, sensor: int) -> str:
    """Sentence on accelerations beyond the range of a sensor, or of those on every link; empty without any."""
    scene, (name, mounted) = recording.scene, list(recording.sensors.items())[sensor]
    columns = slice(len(scene.rig.sensors), None) if scene.every_link else slice(sensor, sensor + 1)
    limit, ay = mounted.range, readings(recording.mean[:, columns], scene.rig)[..., 1]
    if not (beyond := int((abs(ay) > limit).sum())):
        return ""
    limited, free = rms(np.clip(ay, -limit, limit).ravel()), rms(ay.ravel())
    return (
        f"{beyond} of {ay.size} samples of the y acceleration are beyond the sensor's range of {limit:g} g and limited "
        f"to it: RMS is {limited:.4g} g with this sensor and {free:.4g} g without a limit ({name}.range of the rig)"
    )


def _drift_sentence(recording: Recording, sensor: int) -> str:
    """Sentence on a record whose turns drift, of which the start is a part; empty if they only scatter, or are few.

    The last turn differs from the first one by more than the error of the RMS, and the turns follow a straight line
    more closely than four of five records do whose turns only scatter (Student's test of a slope).
    """
    scene, name = recording.scene, list(recording.sensors)[sensor]
    if scene.chain == "belt" or not recording.periods.loop_hz:
        return ""
    ay = sense(recording, sensor=sensor).ay
    edges = turn_edges(len(ay), recording.rate / recording.periods.loop_hz)
    values = np.array([rms(ay[first:last]) for first, last in pairwise(edges)])
    count = len(values)
    if count < LEAST_DRIFTING:
        return ""
    scatter = student(count - 1) * float(values.std(ddof=1)) / sqrt(count)
    error = whole_errors(scene)("rms_g", float(values.mean()), scatter)
    error = error if error == error else scatter  # a linearly implicit step has no known error
    change = float(values[-1] - values[0])
    since = np.arange(count) - 0.5 * (count - 1)
    slope = float(since @ values / (since @ since))
    rest = values - values.mean() - slope * since
    of_slope = sqrt(float(rest @ rest) / (count - 2) / float(since @ since))
    if (
        not abs(change) > error
        or not abs(slope) > student(count - 2, SLOPE_CONFIDENCE) * of_slope
        or change * slope < 0
    ):
        return ""
    of_sensor = f" of {name}" if len(recording.sensors) > 1 else ""
    return (
        f"RMS{of_sensor} goes from {values[0]:.4g} g in the first turn of the loop to {values[-1]:.4g} g in the last, "
        f"by more than its error of {error:.2g} g: the start may not have died away; use a longer lead-in than "
        f"{scene.lead_in:g} s, or ask for a tolerance, which waits for it"
    )
