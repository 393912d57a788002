"""Whether the axes of a sensor's record are those of the simulation: gravity turns in them once a turn of the loop
(Eq. 40).
"""

import shlex
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError
from trackdyn.measure.sensor import OTHER_SPEED, measured_loop_hz, sense, whole_samples
from trackdyn.measure.spectra import high_frequency_rms, highest_line
from trackdyn.rig.rig import Rig
from trackdyn.rig.validation import typed
from trackdyn.scene.scene import Scene
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import Recording

HARMONICS = 3  # multiples of the loop's frequency; in a loop of straight runs they hold nearly all of gravity
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


def high_passed_shape(shape: np.ndarray, hz: float, corner_hz: float, order: int) -> np.ndarray:
    """A `turn_shape` behind a high-pass filter (Butterworth) of first or second order, as a capacitor is one."""
    harmonics = np.arange(shape.shape[1])
    z = 1j * harmonics * hz / corner_hz
    filtered = shape * (z / (1 + z) if order == 1 else z**2 / (1 + 2**0.5 * z + z**2))
    return filtered * np.exp(-1j * np.angle(filtered[:1, 1:2])) ** harmonics


class Doubt(NamedTuple):
    """A sentence on what seems wrong with the axes of a record, and whether gravity is filtered out of it."""

    sentence: str
    without_gravity: bool = False


Axes = tuple[tuple[int, str], ...]  # sign and name of the recorded axis for ay, and for ax where there is one


class Misfits(NamedTuple):
    """Distances (g) of a record from the simulation: as it is read, and with one cause of a difference taken away."""

    as_read: float
    exchanged: float  # with the ``axes`` that fit best
    shifted: float  # without the ``zeros``
    filtered: float  # from the simulation behind a high-pass filter
    ay: float  # the y axis alone
    axes: Axes
    zeros: list[float]  # difference of the means of ay, and of ax, g
    corner_hz: float  # corner of the high-pass filter
    size: float  # size of the simulated y axis, g

    def explains(self, misfit: float, *others: float) -> bool:
        """Whether the record is clearly nearer to the simulation with one cause taken away than with the others."""
        nearer = self.as_read > CLEARLY * misfit and self.as_read - misfit > LEAST_G
        return nearer and all(CLEARLY * misfit < other for other in others)


def misfits(recording: Recording, record: SensorRecord) -> Misfits:
    """Compare mean and first harmonics of the loop's frequency, in y, and in x where the record has it.

    The simulated loop may turn either way: its mirror image does.
    """
    signal, loop_hz = sense(recording), recording.periods.loop_hz
    measured = {axis: getattr(record, f"{axis}_g") for axis in ("ax", "ay", "az")}
    measured = {axis: values for axis, values in measured.items() if values is not None}
    as_read: Axes = ((1, "ay"), (1, "ax")) if "ax" in measured else ((1, "ay"),)
    simulated = turn_shape(np.array([signal.ay, signal.ax][: len(as_read)]), recording.rate, loop_hz)
    mirrored = simulated.conj() * np.array([[1], [-1]])[: len(as_read)]
    band = loop_hz / OTHER_SPEED, loop_hz * OTHER_SPEED
    strongest = max(measured.values(), key=lambda axis: highest_line(axis, record.rate_hz, *band)[1])
    hz = measured_loop_hz(strongest, record.rate_hz, loop_hz)

    def shape_of(axes: Axes) -> np.ndarray:
        return turn_shape(np.array([sign * measured[axis] for sign, axis in axes]), record.rate_hz, hz)

    def misfit(shape: np.ndarray, *forms: np.ndarray) -> float:
        return float(min(np.linalg.norm(shape - form[: len(shape)]) for form in forms))

    scores: dict[Axes, float] = {}
    for chosen in permutations(measured, len(as_read)):
        for signs in product((1, -1), repeat=len(as_read)):
            axes = tuple(zip(signs, chosen, strict=True))
            scores[axes] = misfit(shape_of(axes), simulated, mirrored)
    shape, best = shape_of(as_read), min(scores, key=scores.__getitem__)
    filtered, corner_hz = min(
        (misfit(shape, *(high_passed_shape(form, hz, corner, order) for form in (simulated, mirrored))), corner)
        for corner, order in product(hz * np.geomspace(0.2, 2000, 60), (1, 2))
    )
    return Misfits(
        as_read=scores[as_read],
        exchanged=scores[best],
        shifted=misfit(shape[:, 1:], simulated[:, 1:], mirrored[:, 1:]),
        filtered=filtered,
        ay=misfit(shape_of(((1, "ay"),)), simulated, mirrored),
        axes=best,
        zeros=(shape[:, 0] - simulated[:, 0]).real.tolist(),
        corner_hz=corner_hz,
        size=float(np.linalg.norm(simulated[0])),
    )


def judge_axes(recording: Recording, record: SensorRecord) -> Doubt | None:
    """Say what seems wrong with the axes of a sensor's record, and which options mend it; None if nothing does.

    Gravity crosses the axes in an order that a flipped or exchanged one reverses, and the mean of y points inwards. A
    loop that runs the other way round, as its mirror image does, is not doubted. Other causes that are tried are zeros
    of the sensor that are not 0, and a high-pass filter.
    """
    if not (recording.scene.rig.gravity and recording.periods.loop_hz):
        return None
    fit = misfits(recording, record)
    if fit.explains(fit.shifted, fit.exchanged, fit.filtered):
        zeros = []
        for axis, shift in zip(("ay", "ax"), fit.zeros, strict=False):
            zero, factor = record.scales.get(axis, (0.0, 1.0))
            if abs(shift) > LEAST_G:
                zeros.append(f"--zero {axis}={zero + shift / factor:.5g}")
        return Doubt(
            f"{record.path}: gravity turns in its axes as in the simulated ones, but ay lies {fit.zeros[0]:.3g} g off: "
            f"the value of the file that is 0 g may be another one, {' '.join(zeros)}"
        )
    content = high_frequency_rms(record.ay_g, record.rate_hz)
    expected = high_frequency_rms(sense(recording).ay, recording.rate)
    without_gravity = fit.explains(fit.filtered, fit.exchanged)
    if without_gravity and expected / SAME_CONTENT < content < expected * SAME_CONTENT:
        return Doubt(
            f"{record.path}: gravity is missing, as behind a high-pass filter of about {fit.corner_hz:.2g} Hz: an "
            "AC-coupled (IEPE) sensor, or one whose gravity was filtered out; only high_frequency_g compares",
            without_gravity=True,
        )
    if fit.explains(fit.exchanged):
        options = " ".join(
            f"--axis {shlex.quote(f'{axis}={_column(record, sign, name)}')}"
            for axis, (sign, name) in zip(("ay", "ax"), fit.axes, strict=False)
            if (sign, name) != (1, axis)
        )
        return Doubt(
            f"{record.path}: its axes do not turn through gravity as the simulated ones do, but with {options} they "
            f"would (misfit {fit.exchanged:.2g} g, as read {fit.as_read:.2g} g)"
        )
    if CLEARLY * fit.ay > fit.size:
        filter_too = "; or gravity is missing (an AC-coupled or IEPE sensor): only high_frequency_g compares"
        return Doubt(
            f"{record.path}: ay does not turn through gravity as the simulated y acceleration does (misfit "
            f"{fit.ay:.2g} of {fit.size:.2g} g); check its column and sign (--axis ay=NAME, ay=-NAME), and its unit"
            + filter_too
            * without_gravity
        )
    return None


@typed
def doubtful_axes(recording: Recording, record: SensorRecord) -> str | None:
    """Return the sentence of `judge_axes`, None where nothing seems wrong."""
    doubt = judge_axes(recording, record)
    return doubt and doubt.sentence


@typed
def require_axes(record: SensorRecord, rig: Rig, motor_rpm: float) -> None:
    """Refuse (`InputError`) a record of a turn at least whose axes are doubtful (`doubtful_axes`), before a simulation.

    Links on a belt of this rig at this motor speed (rev/min) turn through gravity, too.
    """
    scene = Scene(rig, motor_rpm, ring_radius=None, chain="belt", contact_log=False)
    duration = whole_samples(rig.rate, scene.periods.loop)
    if doubt := doubtful_axes(belt_recording(scene.with_(duration=duration)), record):
        raise InputError(f"{doubt}; in the pipeline, state axes in the file that sensor_mapping names")


def _column(record: SensorRecord, sign: int, axis: str) -> str:
    """Column of an axis as ``--axis`` takes it, with its sign turned if ``sign`` is -1."""
    name = record.columns.get(axis, axis)
    return name if sign > 0 else name[1:] if name.startswith("-") else f"-{name}"
