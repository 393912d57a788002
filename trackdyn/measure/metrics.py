"""One row of numbers a run: the columns of ``metrics.csv``. A new metric is added here; no simulation depends on it."""

from collections.abc import Callable
from math import hypot, nan
from re import fullmatch

import numpy as np

from trackdyn.measure.catalogue import BY_COLUMN
from trackdyn.measure.columns import SHOWN, described
from trackdyn.measure.contacts import LONGEST_CONTACT, PASSAGE
from trackdyn.measure.sensor import readings, sense
from trackdyn.measure.spectra import LEAST_PERIODS, rms
from trackdyn.measure.taken import meshing_summary, sensor_metrics
from trackdyn.measure.uncertainty import NAN, STEP_ERRORS
from trackdyn.measure.whole_loop import mobilised_friction, work_measures
from trackdyn.scene.scene import Scene
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording

OF_THE_EARTH = 0.005  # share by which gravity differs between poles and equator

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
    """List the measures that a run prints: ``name``, ``measure``, ``value``, ``error`` of scatter and step, ``unit``.

    ``error`` is None where it is not known; measures that are NaN are left out. Of a rig with several sensors a row
    also has the name of its ``sensor``, empty for what is not a sensor's.
    """
    rows, row, whole = [], run_metrics("", recording), whole_errors(recording.scene)
    names = list(recording.scene.rig.sensors)
    several = {name: sensor_row(recording, name) for name in names} if len(names) > 1 else {}
    for name in SHOWN:
        _, unit, text, its_error = described(name)
        sensed = {sensor: columns for sensor, columns in several.items() if name in columns}
        for sensor, columns in (sensed or {"": row}).items():
            value, error = columns[name], columns.get(its_error, NAN)
            if value == value:
                error = whole(name, value, error)
                entry = {"name": name, "measure": text, "value": value}
                entry |= {"error": None if error != error else error, "unit": "" if unit == "1" else unit}
                rows.append(entry | ({"sensor": sensor} if several else {}))
    return rows


def whole_errors(scene: Scene) -> Callable[[str, float, float], float]:
    """Function of a column of a run of a scene, its value and standard error: the error with what the step adds.

    That is in proportion to the step. Other rigs may have more than the included ones: `step_check` judges their steps.
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

    On accelerations beyond the range of a sensor; on the unit g of a rig that is not on the earth.
    """
    scene = recording.scene
    count = 1 if scene.every_link else len(recording.sensors)
    sentences = list(filter(None, (_range_sentence(recording, sensor) for sensor in range(count))))
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
