"""Comparison of a simulation with a sensor's record: the rows of Table 3 and the lines of Figure 18."""

import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.fieldtest.axes import judge_axes
from trackdyn.fieldtest.samples import means, whole_ratio
from trackdyn.fieldtest.sensor_csv import SensorRecord, read_sensor
from trackdyn.fieldtest.sensor_mapping import SensorMapping
from trackdyn.inputs.errors import InputError, naming
from trackdyn.inputs.validation import typed
from trackdyn.measure.catalogue import ACCELERATION
from trackdyn.measure.columns import significant
from trackdyn.measure.estimators import Sensed
from trackdyn.measure.metrics import total_errors
from trackdyn.measure.sensor import SensorSignal, measured_loop_hz, sense
from trackdyn.measure.uncertainty import student, welch_degrees
from trackdyn.simulation.recording import Recording

HIGH = "high_frequency_g"
CLEAR_ERRORS = 2.0  # least standard errors of a speed that differs by more than scatter
SPEED_TOLERANCE = 0.01  # largest relative difference of equal speeds


def sensed_at(recording: Recording, rate: float) -> SensorSignal:
    """Return the signal of a sensor of a ``rate`` (Hz) up to that of the recording: means over its samples."""
    if count := whole_ratio(recording.rate, rate):
        return sense(recording, count)
    signal = sense(recording)
    ax, ay = (means(values, signal.rate, rate) for values in (signal.ax, signal.ay))
    time = signal.time[0] - 1 / signal.rate + np.arange(1, ay.size + 1) / rate
    return SensorSignal(time, ax, ay, rate, signal.clipped)


@typed
def compare(
    recording: Recording, sensor: SensorRecord | pd.DataFrame | Path | str, mapping: SensorMapping | None = None
) -> pd.DataFrame:
    """Compare a recording with a sensor's record; warn of anything that seems wrong with the record.

    The faster one is averaged over samples of the slower.

    Parameters
    ----------
    recording : Recording
        Simulation.
    sensor : SensorRecord, DataFrame or path
        Record of `read_sensor`, or a table or file that it reads.
    mapping : SensorMapping, optional
        Meaning of the columns of a table or file.

    Returns
    -------
    DataFrame
        ``measure, simulation, simulation_error, sensor, sensor_error, difference_pct, standard_errors, clear_from``:
        values and standard errors over whole revolutions of the loop, those of the simulation with its step error;
        simulation minus sensor, in percent of the sensor's value and in standard errors of the difference; and the
        number of these above which it is more than scatter, Student's factor of 95 % for the turns of both (Welch).
        Rows of the line are left out below two turns of the loop; those of gravity, where the sensor's record lacks it.

    Raises
    ------
    InputError
        The record is ambiguous or does not fit the recording.
    """
    if not isinstance(sensor, SensorRecord):
        sensor = read_sensor(sensor, mapping, next(iter(recording.sensors.values())).range, recording.scene.rig.g)
    table = compare_with_sensor(recording, sensor)
    for sentence in doubts_of(recording, sensor, table):
        warnings.warn(sentence, stacklevel=2)
    return table


def doubts_of(recording: Recording, record: SensorRecord, table: pd.DataFrame) -> list[str]:
    """List warnings on a sensor's record; without fitting axes the line that is taken for its speed may be noise."""
    doubt = judge_axes(recording, record)[0] or other_speed(recording, record, table)
    return [*record.doubts, *filter(None, [doubt])]


@typed
def compare_with_sensor(recording: Recording, record: SensorRecord, name: str = "the recording") -> pd.DataFrame:
    """Return the table of `compare`, or `InputError` for less than a turn; ``name`` is that of the recording."""
    loop_hz = recording.periods.loop_hz
    slow, own_hz = record.averaged(recording.rate), 0.0
    if loop_hz:
        if recording.seconds * loop_hz < 1:
            reason = f"the record of {recording.seconds:.4g} s is shorter than one turn of the loop"
            raise InputError(f"{name}: {reason}; record at least {1 / loop_hz:.4g} s")
        record.require_turns(1 / loop_hz)
        with naming(record.path):
            own_hz = measured_loop_hz(slow.ay, slow.rate, loop_hz)
    signal = sensed_at(recording, min(record.rate, recording.rate))
    measures = [measure for measure in ACCELERATION if measure.column.shown or not measure.column.text]
    columns: dict[str, list] = {"measure": ["rate_hz", "clipped", *(measure.column.name for measure in measures)]}
    degrees = {}
    for side, ay, hz, at, clipped in (
        ("simulation", signal.ay, loop_hz, signal.rate, signal.clipped),
        ("sensor", slow.ay, own_hz, slow.rate, record.clipped),
    ):
        sensed = Sensed(ay, at, hz)
        values = [(at, np.nan), (clipped, np.nan), *(measure.estimator(sensed) for measure in measures)]
        columns[side], columns[f"{side}_error"] = map(list, zip(*values, strict=True))
        degrees[side] = [0, 0, *(sensed.degrees(measure.column.name) for measure in measures)]
    table, total = pd.DataFrame(columns), total_errors(recording.scene)
    scatters = [zip(table[f"{side}_error"], degrees[side], strict=True) for side in degrees]  # without the step
    table["simulation_error"] = list(map(total, table.measure, table.simulation, table.simulation_error))
    excess = (table.simulation - table.sensor).where(table.index > 1)  # rate and clipped samples are no measures
    scatter = np.hypot(table.simulation_error, table.sensor_error)
    table["difference_pct"] = 100 * excess / table.sensor.abs().replace(0, np.nan)
    table["standard_errors"] = excess / scatter.replace(0, np.nan)
    clear = [student(welch_degrees(error, *both)) for error, *both in zip(scatter, *scatters, strict=True)]
    table["clear_from"] = np.where(np.isfinite(table["standard_errors"]), clear, np.nan)
    compared = table[["simulation", "sensor"]].notna().all(axis=1)
    if judge_axes(recording, record)[1]:  # without gravity
        compared = table.measure.isin(["rate_hz", "clipped", HIGH])
    return table[compared].reset_index(drop=True)


def in_words(table: pd.DataFrame) -> str:
    """Return sentences on the differences of RMS and SD, or of the content from 20 Hz on where gravity is missing."""
    rows = table.set_index("measure")
    names = {"rms_g": "RMS", "sd_g": "SD"} if "rms_g" in rows.index else {HIGH: "content from 20 Hz on"}
    sentences = []
    for measure, name in names.items():
        excess, errors, clear = rows.loc[measure, ["difference_pct", "standard_errors", "clear_from"]].astype(float)
        by = f": differs by {significant(abs(errors), 2)} standard errors"
        if not np.isfinite(errors):
            by = " (no standard error: a record has fewer than two turns of the loop, or its step has no known error)"
        elif abs(errors) < clear:
            by = f", within {clear:.2g} standard errors: not significant"
        side = "above" if excess > 0 else "below"
        if np.isfinite(excess):
            sentences.append(f"{name} of the simulation {abs(excess):.3g} % {side} the sensor's{by}")
    return "; ".join(sentences)


def other_speed(recording: Recording, record: SensorRecord, table: pd.DataFrame) -> str | None:
    """Return a sentence on the speed of a sensor's record, if the simulated loop turns at another; else None.

    It differs by two standard errors and by 1 %: over 2.5 turns a noisy line is that of the whole record to 0.9 %.
    """
    hz, rpm, lines = recording.periods.loop_hz, recording.scene.motor_rpm, table.set_index("measure")
    if record.wraps or "line_hz_binfree" not in lines.index:
        return None
    own_hz, error = lines.loc["line_hz_binfree", ["sensor", "sensor_error"]].astype(float).fillna(0.0)
    if abs(own_hz - hz) <= max(SPEED_TOLERANCE * hz, CLEAR_ERRORS * error):
        return None
    turns = f"{own_hz:.4g} times per second" + (f" (standard error {error:.2g})" if error else "")
    remedy = f"compare with a run at {rpm * own_hz / hz:.4g} rpm"
    if "taken for" in (source := record.done.get("rate", "")):
        turns += f" at {source}"
        remedy += ", or give the rate if it is another, `time: none, rate: HZ`"
    other = f"{hz:.4g} times at {rpm:g} rpm, {abs(hz / own_hz - 1):.1%} {'slower' if hz < own_hz else 'faster'}"
    return f"{record.path}: its loop turns {turns}, the simulated one {other}; {remedy}"
