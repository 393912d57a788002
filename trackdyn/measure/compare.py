"""A simulated record beside a sensor's: the rows of Table 3 and the lines of Figure 18, and whether its axes are alike:
gravity turns in them once a turn of the loop (Eq. 40).
"""

import shlex
from collections.abc import Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, naming
from trackdyn.measure.columns import error_of
from trackdyn.measure.metrics import SAME_SPEED
from trackdyn.measure.sensor import (
    OTHER_SPEED,
    measured_loop_hz,
    sense,
    sensor_metrics,
    whole_revolutions,
    whole_samples,
)
from trackdyn.measure.spectra import high_frequency_rms, highest_line, holds_line
from trackdyn.measure.uncertainty import turn_error
from trackdyn.rig.rig import Rig
from trackdyn.rig.validation import typed
from trackdyn.scene.scene import Scene
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import Recording

COMPARED = ("rms_g", "sd_g", "line_hz", "line_g", "line_hz_binfree", "line_g_binfree", "high_frequency_g")
HIGH = "high_frequency_g"
MEAN = "mean_whole_g"
CLEAR = 2.0  # standard errors, from which on a difference is more than scatter
SAME_RATE = 0.01  # changes what the mean over a sample leaves of 300 Hz by 0.3 %


def whole_ratio(record: SensorRecord, rate: float) -> tuple[int, int]:
    """Numbers of the sensor's samples, and of those at ``rate`` (Hz), that take the same time: one of them is 1.

    Raises `InputError`: neither rate is a multiple of the other, to ``SAME_RATE``.
    """
    ratio = record.rate_hz / rate
    counts = max(round(ratio), 1), max(round(1 / ratio), 1)
    if abs(ratio * counts[1] / counts[0] - 1) > SAME_RATE:
        raise InputError(
            f"{record.path}: has {record.rate_hz:.6g} samples a second, the simulation {rate:g}, and neither is a "
            f"multiple of the other; simulate with `trackdyn simulate --rate {round(record.rate_hz)}`, in the pipeline "
            "with that sensor.rate in the rig"
        )
    return counts


@typed
def compare_with_sensor(recording: Recording, record: SensorRecord, name: str = "the recording") -> pd.DataFrame:
    """Measures of both records and their difference, the faster record averaged over the samples of the slower one.

    A simulated sample is the mean over its interval, so means of some of them are the samples of a slower sensor.

    Parameters
    ----------
    recording, record
        Simulation and sensor.
    name : str
        What the recording is called in a refusal.

    Returns
    -------
    DataFrame
        ``measure, simulation, simulation_error, sensor, sensor_error, difference_pct, standard_errors``: standard
        errors over revolutions of the loop (`sensor_metrics`); what the simulation is above the sensor, in percent of
        the sensor's value and in standard errors of the difference. Rows of the line are left out where a record holds
        fewer than two turns of the loop, and those of its bin where the records differ in length; all that gravity is
        part of, where it is missing in the sensor's record (`judge_axes`).

    Raises
    ------
    InputError
        The rates do not fit, or a record is shorter than one turn of the loop.
    """
    loop_hz = recording.periods.loop_hz
    if loop_hz and recording.seconds * loop_hz < 1:
        reason = f"the record of {recording.seconds:.4g} s is shorter than one turn of the loop"
        raise InputError(f"{name}: {reason}; record at least {1 / loop_hz:.4g} s")
    if loop_hz:
        record.require_turns(1 / loop_hz)
    faster, slower = whole_ratio(record, recording.rate)
    whole = record
    signal, rate, record = sense(recording, slower), recording.rate / slower, record.averaged(faster)
    with naming(record.path):
        own_hz = measured_loop_hz(record.ay_g, record.rate_hz, loop_hz) if loop_hz else 0.0
    both = []
    for ay, hz, at, clipped in (
        (signal.ay, loop_hz, rate, signal.clipped),
        (record.ay_g, own_hz, record.rate_hz, record.clipped),
    ):
        mean = {MEAN: np.mean(ay[: whole_revolutions(len(ay), at, hz)])}
        if holds_line(len(ay), at, hz):
            mean["mean_error_g"] = turn_error(ay, 1 / hz * at, np.mean)
        both.append(sensor_metrics(ay, at, hz) | mean | {"rate_hz": at, "clipped": clipped})
    errors = {"rate_hz": "", "clipped": "", MEAN: "mean_error_g"} | {name: error_of(name) for name in COMPARED}
    columns = {
        f"{side}{ending}": [values.get(name, np.nan) for name in names]
        for side, values in zip(("simulation", "sensor"), both, strict=True)
        for ending, names in (("", errors.keys()), ("_error", errors.values()))
    }
    table = pd.DataFrame({"measure": list(errors), **columns})
    off = (table.simulation - table.sensor).where(table.index > 1)  # rate and clipped samples are no measures
    scatter = np.hypot(table.simulation_error, table.sensor_error)
    table["difference_pct"] = 100 * off / table.sensor.abs().replace(0, np.nan)
    table["standard_errors"] = off / scatter.replace(0, np.nan)
    binned = table.measure.isin(["line_hz", "line_g"]) & (len(signal.ay) != len(record.ay_g))
    lines = table.measure.str.startswith("line")
    if (doubt := judge_axes(recording, whole)) and doubt.without_gravity:
        return table[table.measure.isin(["rate_hz", "clipped", HIGH])].reset_index(drop=True)
    return table[~(binned | lines & (table.simulation.isna() | table.sensor.isna()))].reset_index(drop=True)


def in_words(table: pd.DataFrame) -> str:
    """What a table of `compare_with_sensor` comes to: RMS and SD, by how much and how many standard errors.

    Where gravity is missing, the content from 20 Hz on instead.
    """
    parts = []
    rows = table.set_index("measure")
    for measure, name in (("rms_g", "RMS"), ("sd_g", "SD"), (HIGH, "content from 20 Hz on")):
        if measure not in rows.index or (measure == HIGH and "rms_g" in rows.index):
            continue
        off, errors = rows.difference_pct[measure], rows.standard_errors[measure]
        by = f"{abs(off):.3g} % {'above' if off > 0 else 'below'} the sensor's"
        if not np.isfinite(off):
            continue
        if not np.isfinite(errors):
            by += " (no standard error: a record holds fewer than two turns of the loop)"
        elif abs(errors) < CLEAR:
            by += f", within {CLEAR:g} standard errors: no difference that these records tell"
        else:
            by += f": differs by {abs(errors):.2g} standard errors"
        parts.append(f"{name} of the simulation {by}")
    return "; ".join(parts)


@typed
def other_speed(recording: Recording, record: SensorRecord, table: pd.DataFrame) -> str | None:
    """What a sensor's record shows of its speed, if the simulated loop turns at another; of a `compare_with_sensor`.

    Another is one that differs by more than two standard errors and by more than 1 %: over 2.5 turns the line of a
    noisy record is that of the whole record to 0.9 %.
    """
    hz, rpm, lines = recording.periods.loop_hz, recording.made_rpm, table.set_index("measure")
    if "line_hz_binfree" not in lines.index:
        return None
    seen, error = lines.loc["line_hz_binfree", ["sensor", "sensor_error"]].astype(float).fillna(0.0)
    if abs(seen - hz) <= max(SAME_SPEED * hz, CLEAR * error):
        return None
    return (
        f"{record.path}: its loop turns {seen:.4g} times a second{f' (+- {error:.2g})' if error else ''}, the "
        f"simulated one {hz:.4g} times at {rpm:g} rpm, {abs(hz / seen - 1):.1%} {'slower' if hz < seen else 'faster'}; "
        f"compare with a run at {rpm * seen / hz:.4g} rpm"
    )


HARMONICS = 3  # of the loop's frequency; in a loop of straight runs these hold nearly all of gravity
LEAST_G = 0.1  # zero offset of a cheap sensor: a smaller difference tells nothing
CLEARLY = 2.0  # times better
SAME_CONTENT = 1.5  # ratio of the contents from 20 Hz on, up to which two records may be of the same unit


def turn_shape(axes: np.ndarray, rate: float, hz: float) -> np.ndarray:
    """Mean and first harmonics of the loop's frequency in a record, free of the instant at which it begins.

    ``axes`` are (a, N) accelerations, of which the first one's crest begins a turn; ``rate`` and ``hz`` are samples and
    turns of the loop a second. Returned is, (a, HARMONICS + 1) in the unit of ``axes``, the mean over whole turns;
    amplitudes are divided by the root of 2, so that squares add up to the mean square.
    """
    length = min(int(rate / hz), axes.shape[1])
    starts = (np.arange(max(int((axes.shape[1] - length) / rate * hz + 1e-6) + 1, 1)) * rate / hz).astype(int)
    order = np.arange(HARMONICS + 1)
    waves = np.exp(-2j * np.pi / length * np.outer(order, np.arange(length))) / length
    amplitudes = np.array([axes[:, start : start + length] @ waves.T for start in starts])
    crest = np.exp(1j * np.angle(amplitudes[:, :1, 1:2]))
    return (amplitudes * crest.conj() ** order).mean(axis=0) * np.where(order, 2**0.5, 1)


class Doubt(NamedTuple):
    """What seems wrong with the axes of a record, in a sentence, and whether gravity is filtered out of it."""

    sentence: str
    without_gravity: bool = False


def high_passed_shape(shape: np.ndarray, hz: float, corner_hz: float, order: int) -> np.ndarray:
    """A `turn_shape` behind a high-pass filter (Butterworth) of first or second order, as a capacitor is one."""
    harmonics = np.arange(shape.shape[1])
    z = 1j * harmonics * hz / corner_hz
    filtered = shape * (z / (1 + z) if order == 1 else z**2 / (1 + 2**0.5 * z + z**2))
    return filtered * np.exp(-1j * np.angle(filtered[:1, 1:2])) ** harmonics


def judge_axes(recording: Recording, record: SensorRecord) -> Doubt | None:
    """What seems wrong with the axes of a sensor's record, and which options mend it; None if nothing does.

    Compared are mean and first harmonics of the loop's frequency, over a turn at least, in y, and in x where the record
    has it: gravity crosses the axes in an order that a flipped or exchanged one reverses, and the mean of y points
    inwards. A loop that runs the other way round, as its mirror image does, is not doubted. Other causes that are tried
    are zeros of the sensor that are not 0, and a high-pass filter.
    """
    if not (recording.scene.rig.gravity and recording.periods.loop_hz):
        return None
    signal = sense(recording)
    measured = {name: getattr(record, f"{name}_g") for name in ("ax", "ay", "az")}
    measured = {name: values for name, values in measured.items() if values is not None}
    names = ("ay", "ax") if "ax" in measured else ("ay",)
    hz = recording.periods.loop_hz
    simulated = turn_shape(np.array([signal.ay, signal.ax][: len(names)]), recording.rate, hz)
    mirrored = simulated.conj() * np.array([[1], [-1]])[: len(names)]
    band = hz / OTHER_SPEED, hz * OTHER_SPEED
    strongest = max(measured.values(), key=lambda one: highest_line(one, record.rate_hz, *band)[1])
    hz = measured_loop_hz(strongest, record.rate_hz, hz)

    def shape_of(chosen: Sequence[tuple[int, str]]) -> np.ndarray:
        return turn_shape(np.array([sign * measured[name] for sign, name in chosen]), record.rate_hz, hz)

    def misfit(shape: np.ndarray, *forms: np.ndarray) -> float:
        return float(min(np.linalg.norm(shape - form[: len(shape)]) for form in forms))

    scores = {
        turn_of: misfit(shape_of(turn_of), simulated, mirrored)
        for chosen in permutations(measured, len(names))
        for signs in product((1, -1), repeat=len(names))
        for turn_of in [tuple(zip(signs, chosen, strict=True))]
    }
    as_read = tuple((1, name) for name in names)
    read, shape = scores[as_read], shape_of(as_read)
    best = min(scores, key=scores.__getitem__)
    shifted = misfit(shape[:, 1:], simulated[:, 1:], mirrored[:, 1:])
    corners = product(hz * np.geomspace(0.2, 2000, 60), (1, 2))
    filtered, corner = min(
        (misfit(shape, *(high_passed_shape(form, hz, *corner) for form in (simulated, mirrored))), corner[0])
        for corner in corners
    )

    def explains(score: float, *others: float) -> bool:
        return read > CLEARLY * score and read - score > LEAST_G and all(CLEARLY * score < other for other in others)

    if explains(shifted, scores[best], filtered):
        off = (shape[:, 0] - simulated[:, 0]).real
        scales = [record.scales.get(axis, (0.0, 1.0)) for axis in names]
        zeros = " ".join(
            f"--zero {axis}={zero + value / factor:.5g}"
            for axis, value, (zero, factor) in zip(names, off, scales, strict=True)
            if abs(value) > LEAST_G
        )
        return Doubt(
            f"{record.path}: gravity turns in its axes as in the simulated ones, but ay lies {off[0]:.3g} g off: "
            f"the value of the file that is 0 g may be another one, {zeros}"
        )
    content, expected = high_frequency_rms(record.ay_g, record.rate_hz), high_frequency_rms(signal.ay, recording.rate)
    without_gravity = explains(filtered, scores[best])
    if without_gravity and expected / SAME_CONTENT < content < expected * SAME_CONTENT:
        return Doubt(
            f"{record.path}: gravity is missing, as behind a high-pass filter of about {corner:.2g} Hz: an AC-coupled "
            "(IEPE) sensor, or one whose gravity was filtered out; only high_frequency_g compares",
            without_gravity=True,
        )
    if explains(scores[best]):
        options = " ".join(
            f"--axis {shlex.quote(f'{axis}={_column(record, sign, name)}')}"
            for axis, (sign, name) in zip(names, best, strict=True)
            if (sign, name) != (1, axis)
        )
        return Doubt(
            f"{record.path}: its axes do not turn through gravity as the simulated ones do, but with {options} they "
            f"would (misfit {scores[best]:.2g} g, as read {read:.2g} g)"
        )
    size = np.linalg.norm(simulated[0])
    alone = misfit(shape_of([(1, "ay")]), simulated, mirrored)
    if CLEARLY * alone > size:
        return Doubt(
            f"{record.path}: ay does not turn through gravity as the simulated y acceleration does (misfit {alone:.2g} "
            f"of {size:.2g} g); check its column and sign (--axis ay=NAME, ay=-NAME), and its unit"
            + "; or gravity is missing (an AC-coupled or IEPE sensor): only high_frequency_g compares"
            * without_gravity
        )
    return None


@typed
def doubtful_axes(recording: Recording, record: SensorRecord) -> str | None:
    """The sentence of `judge_axes`."""
    doubt = judge_axes(recording, record)
    return doubt and doubt.sentence


@typed
def require_axes(record: SensorRecord, rig: Rig, motor_rpm: float) -> None:
    """Refuse (`InputError`) a record of a turn at least whose axes are doubtful (`doubtful_axes`), before a simulation.

    Links on a belt of this rig at this motor speed (rev/min) turn through gravity, too.
    """
    scene = Scene(rig, motor_rpm, ring_radius=None, chain="belt", contact_log=False)
    turn = whole_samples(rig.rate, scene.periods.loop)
    if doubt := doubtful_axes(belt_recording(scene.with_(duration=turn)), record):
        raise InputError(f"{doubt}; in the pipeline, state axes in the file that sensor_mapping names")


def _column(record: SensorRecord, sign: int, axis: str) -> str:
    """Column of an axis as ``--axis`` takes it, with its sign turned if ``sign`` is -1."""
    name = record.columns.get(axis, axis)
    return name if sign > 0 else name[1:] if name.startswith("-") else f"-{name}"
