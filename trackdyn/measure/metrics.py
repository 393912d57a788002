"""Metrics of a run: a row of ``metrics.csv``. New metrics are added here; no simulation depends on them."""

from collections.abc import Callable
from itertools import pairwise
from math import hypot, nan, sqrt
from re import fullmatch

import numpy as np

from trackdyn.measure.catalogue import ACCELERATION, BY_COLUMN, CATALOGUE, Passages
from trackdyn.measure.columns import SHOWN, described
from trackdyn.measure.contacts import LONGEST_CONTACT, PASSAGE
from trackdyn.measure.estimators import Sensed, meshing_summary, sensor_metrics
from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import LEAST_PERIODS, rms
from trackdyn.measure.uncertainty import NAN, STEP_ERRORS, batch_degrees, student, turn_edges
from trackdyn.measure.whole_loop import mobilised_friction, work_measures
from trackdyn.scene.scene import Scene
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.signals import normal_signal

GRAVITY_RANGE = 0.005  # relative difference of gravity between poles and equator
LEAST_DRIFTING, SLOPE_CONFIDENCE = 4, 0.8  # turns for a test of drift, and the confidence of its slope
STUDIED_METHODS = ("semi_implicit", "rk4")  # with known step errors: a linearly implicit step is coarse on purpose


def sensor_row(recording: Recording, sensor: str | int = 0) -> dict:
    """Return the columns of a run for one sensor."""
    signal = sense(recording, sensor=sensor)
    return sensor_metrics(signal.ay, recording.rate, recording.periods.loop_hz) | {"clipped_samples": signal.clipped}


def run_metrics(name: str, recording: Recording) -> dict:
    """Return the row of a run: its scene, and the metrics of its first sensor and of its contacts."""
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

    The standard error and half of the 95 % interval include scatter and step; they are None if unknown. Measures that
    are NaN are left out. With several sensors a row has the name of its ``sensor``, too, empty for other measures.
    """
    rows, row, total = [], run_metrics("", recording), total_errors(recording.scene)
    names, periods = list(recording.scene.rig.sensors), recording.periods
    several = {name: sensor_row(recording, name) for name in names} if len(names) > 1 else {}
    of_turns = Sensed(np.zeros(len(recording.time)), recording.rate, periods.loop_hz).degrees
    whole = int(recording.seconds / periods.passage + 1e-6) if periods.loop_hz else 0

    def degrees(column: str) -> int:
        """Return the degrees of freedom of the standard error of a column, over turns or batches of passages."""
        measure = BY_COLUMN.get(column)
        if measure in ACCELERATION:
            return of_turns(column)
        return batch_degrees(int(row["passages"]) if measure and isinstance(measure.estimator, Passages) else whole)

    for name in SHOWN:
        _, unit, text, its_error = described(name)
        sensed = {sensor: columns for sensor, columns in several.items() if name in columns}
        for sensor, columns in (sensed or {"": row}).items():
            value, error = columns[name], columns.get(its_error, NAN)
            if value == value:
                half_width = total(name, value, student(degrees(name)) * error if error else error)
                errors = {"error": total(name, value, error), "half_width": half_width}
                entry = {"name": name, "measure": text, "value": value}
                entry |= {kind: None if size != size else size for kind, size in errors.items()}
                rows.append(entry | {"unit": "" if unit == "1" else unit} | ({"sensor": sensor} if several else {}))
    return rows


def total_errors(scene: Scene) -> Callable[[str, float, float], float]:
    """Return a function of column, value and standard error (or half of an interval): the error including the step's.

    The step error is the largest known one, in proportion to the step; other rigs than the included ones may have a
    larger one, which `step_check` bounds. NaN if one of the two is unknown; a value of zero has the standard error.
    """
    ratio = 0.0 if scene.chain == "belt" else scene.time_step / scene.with_(step=None).time_step
    ratio = ratio if scene.chain == "belt" or scene.integrator in STUDIED_METHODS else nan

    def total(column: str, value: float, error: float) -> float:
        step_error = next((errors for name, errors in STEP_ERRORS.items() if fullmatch(name, column)), (nan, nan))
        size = BY_COLUMN[column].column.size(value) if column in BY_COLUMN else abs(value)
        return hypot(error, ratio * step_error[scene.ring_radius is None] * size) if value else error

    return total


def unknown_step_errors() -> list[str]:
    """Return the columns of measures that have a standard error but no known error of the step."""
    estimated = (column.name for column, *_ in CATALOGUE if column.text and column.has_error)
    return [column for column in estimated if not any(fullmatch(name, column) for name in STEP_ERRORS)]


def needed_lengths(recording: Recording) -> dict[str, float]:
    """Return the measures that need a longer recording, with the length (s) that suffices wherever it begins."""
    periods = recording.periods
    needed = {"dominant peak and standard errors": LEAST_PERIODS * periods.loop}
    if recording.scene.contact_log:
        needed["contacts of the recorded pitches"] = periods.loop + (2 * LONGEST_CONTACT + PASSAGE) * periods.turn
    return {measure: seconds for measure, seconds in needed.items() if recording.seconds < seconds}


def remarks(recording: Recording) -> list[str]:
    """Return warnings on the numbers of a run: on ranges of sensors, a transient, and g of a rig not on the earth."""
    count = 1 if recording.scene.every_link else len(recording.sensors)
    sentences = list(filter(None, (_range_sentence(recording, sensor) for sensor in range(count))))
    sentences += filter(None, (_drift_sentence(recording, sensor) for sensor in range(len(recording.sensors))))
    gravity = recording.scene.rig.gravity
    if gravity and abs(gravity / 9.81 - 1) >= GRAVITY_RANGE:
        sentences.append(f"1 g is the rig's gravity of {gravity:g} m/s2; a sensor shows multiples of 9.81 m/s2")
    return sentences


def _range_sentence(recording: Recording, sensor: int) -> str:
    """Return a warning on accelerations beyond the range of a sensor, or of those on every link; empty without any."""
    scene, (name, mounted) = recording.scene, list(recording.sensors.items())[sensor]
    columns = slice(len(scene.rig.sensors), None) if scene.every_link else slice(sensor, sensor + 1)
    limit, ay = mounted.range, normal_signal(recording.mean[:, columns], scene.rig)
    if not (beyond := int((abs(ay) > limit).sum())):
        return ""
    limited, free = rms(np.clip(ay, -limit, limit).ravel()), rms(ay.ravel())
    return (
        f"{beyond} of {ay.size} samples of the y acceleration are beyond the sensor's range of {limit:g} g and limited "
        f"to it: RMS is {limited:.4g} g with this sensor and {free:.4g} g without a limit ({name}.range of the rig)"
    )


def _drift_sentence(recording: Recording, sensor: int) -> str:
    """Return a warning if turns differ by more than the error of the RMS, with a significant slope; else empty."""
    scene, name = recording.scene, list(recording.sensors)[sensor]
    if scene.chain == "belt" or not recording.periods.loop_hz:
        return ""
    ay = sense(recording, sensor=sensor).ay
    edges = turn_edges(len(ay), recording.rate / recording.periods.loop_hz)
    values = np.array([rms(ay[first:last]) for first, last in pairwise(edges)])
    if (count := len(values)) < LEAST_DRIFTING:
        return ""
    scatter = student(count - 1) * float(values.std(ddof=1)) / sqrt(count)
    error = total_errors(scene)("rms_g", float(values.mean()), scatter)
    error = error if error == error else scatter  # a linearly implicit step has no known error
    change = float(values[-1] - values[0])
    (slope, _), covariance = np.polyfit(np.arange(count), values, 1, cov=True)
    significant = abs(slope) > student(count - 2, SLOPE_CONFIDENCE) * sqrt(covariance[0, 0])
    if not abs(change) > error or not significant or change * slope < 0:
        return ""
    of_sensor = f" of {name}" if len(recording.sensors) > 1 else ""
    return (
        f"RMS{of_sensor} goes from {values[0]:.4g} g in the first turn of the loop to {values[-1]:.4g} g in the last, "
        f"by more than its error of {error:.2g} g: the transient may not have decayed; use a longer lead-in than "
        f"{scene.lead_in:g} s, or a tolerance"
    )
