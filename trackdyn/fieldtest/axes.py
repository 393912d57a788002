"""Check of a sensor's axes: gravity turns in them once per turn of the loop, as in the simulated ones (Eq. 40)."""

import re
from itertools import permutations, product
from math import inf

import numpy as np

from trackdyn.fieldtest.sensor_csv import SensorRecord, turned
from trackdyn.inputs.errors import InputError
from trackdyn.measure.sensor import OTHER_SPEED, measured_loop_hz, sense, whole_samples
from trackdyn.measure.spectra import high_frequency_rms, highest_line
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import Recording

HARMONICS = 3  # multiples of the loop's frequency; in a loop of straight runs they hold nearly all of gravity
LEAST_G = 0.1  # zero offset of a cheap sensor: a smaller difference tells nothing
CLEARLY = 2.0  # times better
LEAST_DEG, LEAST_FACTOR = 5.0, 1.2  # a smaller angle, or a factor nearer to 1, is not named
LIKELY_FACTORS = [2.0**k for k in range(-6, 7)] + [1e-3, 1e3, 9.81, 1 / 9.81]  # ranges of a sensor, units
SAME_FACTOR = 0.05  # largest error of a fitted factor, of its logarithm
SAME_CONTENT = 1.5  # ratio of the contents from 20 Hz on, up to which two records may be of the same unit
Axes = tuple[tuple[int, str], ...]  # sign and name of the recorded axis for ay, and for ax where there is one


def turn_shape(axes: np.ndarray, rate: float, hz: float) -> np.ndarray:
    """Return mean and first harmonics of the loop's frequency in a record, whatever the instant at which it begins.

    ``axes`` are (a, N) accelerations, of which the first one's crest begins a turn; ``hz`` are turns per second. The
    result, (a, HARMONICS + 1), is the mean over whole turns; squares of its amplitudes add up to the mean square.
    """
    length = min(int(rate / hz), axes.shape[1])
    starts = (np.arange(max(int((axes.shape[1] - length) / rate * hz + 1e-6) + 1, 1)) * rate / hz).astype(int)
    order = np.arange(HARMONICS + 1)
    waves = np.exp(-2j * np.pi / length * np.outer(order, np.arange(length))) / length
    amplitudes = np.array([axes[:, start : start + length] @ waves.T for start in starts])
    return _begun_at_crest(amplitudes).mean(axis=0) * np.where(order, 2**0.5, 1)


def high_passed_shape(shape: np.ndarray, hz: float, corner_hz: float, order: int) -> np.ndarray:
    """Return a `turn_shape` behind a high-pass filter (Butterworth) of first or second order."""
    z = 1j * np.arange(shape.shape[1]) * hz / corner_hz
    return _begun_at_crest(shape * (z / (1 + z) if order == 1 else z**2 / (1 + 2**0.5 * z + z**2)))


def _begun_at_crest(shape: np.ndarray) -> np.ndarray:
    return shape * np.exp(-1j * np.angle(shape[..., :1, 1:2])) ** np.arange(shape.shape[-1])


def _shapes(recording: Recording, record: SensorRecord) -> tuple[list[np.ndarray], dict[Axes, np.ndarray], float]:
    """Return shapes of a turn, simulated and mirrored, and by choice of axes, as read first; and the loop's Hz."""
    signal, loop_hz = sense(recording), recording.periods.loop_hz
    recorded = {axis: values for axis in ("ay", "ax", "az") if (values := getattr(record, axis)) is not None}
    count = 1 + ("ax" in recorded)
    simulated = turn_shape(np.array([signal.ay, signal.ax][:count]), recording.rate, loop_hz)
    band = loop_hz / OTHER_SPEED, loop_hz * OTHER_SPEED
    strongest = max(recorded.values(), key=lambda axis: highest_line(axis, record.rate, *band)[1])
    hz = measured_loop_hz(strongest, record.rate, loop_hz)
    shapes = {}
    for names, signs in product(permutations(recorded, count), product((1, -1), repeat=count)):
        axes = tuple(zip(signs, names, strict=True))
        shapes[axes] = turn_shape(np.array([sign * recorded[name] for sign, name in axes]), record.rate, hz)
    return [simulated, simulated.conj() * np.array([[1], [-1]])[:count]], shapes, hz


def _turned_and_scaled(shape: np.ndarray, forms: list[np.ndarray]) -> tuple[float, float, float]:
    """Return misfit (g), angle about z (deg) and factor of a shape brought nearest to one of the forms."""
    fits = [(inf, 0.0, 1.0)]
    for angle in range(-179, 181) if len(shape) > 1 else (0,):
        back = _begun_at_crest(np.array(turned(shape[1], shape[0], angle)[::-1]) if len(shape) > 1 else shape)
        for form in forms:
            factor = np.vdot(back, form).real / np.vdot(back, back).real
            if factor > 0:
                fits.append((float(np.linalg.norm(factor * back - form)), float(angle), float(factor)))
    return min(fits)


def _misfit(shape: np.ndarray, forms: list[np.ndarray]) -> float:
    """Return the distance (g) of a shape from the nearest of some forms."""
    return min(float(np.linalg.norm(shape - form[: len(shape)])) for form in forms)


def judge_axes(recording: Recording, record: SensorRecord) -> tuple[str, bool]:
    """Return a warning on a record's axes with its remedy, empty if they fit, and whether gravity is filtered out.

    Gravity crosses the axes in an order that a flipped or exchanged one reverses, and the mean of y points inwards. A
    loop that runs the other way round, as its mirror image does, fits, too.
    """
    if not (recording.scene.rig.gravity and recording.periods.loop_hz) or record.wraps:
        return "", False
    forms, shapes, hz = _shapes(recording, record)
    signal = sense(recording)
    misfits = {axes: _misfit(shape, forms) for axes, shape in shapes.items()}
    (own, shape), best = next(iter(shapes.items())), min(misfits, key=misfits.__getitem__)
    as_read, exchanged = misfits[own], misfits[best]
    shifted = _misfit(shape[:, 1:], [form[:, 1:] for form in forms])
    filtered, corner_hz = min(
        (_misfit(shape, [high_passed_shape(form, hz, corner, order) for form in forms]), corner)
        for corner, order in product(hz * np.geomspace(0.2, 2000, 60), (1, 2))
    )
    fitted, angle, factor = _turned_and_scaled(shape, forms)
    back = turned(0.0 if record.ax is None else record.ax, record.ay, angle)[1]
    content = high_frequency_rms(signal.ay, recording.rate)

    def explains(misfit: float, *others: float, ay: np.ndarray | None = None) -> bool:
        """Return whether the record is clearly nearer without one cause than as it is read, and than without others."""
        same_content = ay is None or 1 / SAME_CONTENT < high_frequency_rms(ay, record.rate) / content < SAME_CONTENT
        nearer = as_read > CLEARLY * misfit and as_read - misfit > LEAST_G
        return nearer and all(CLEARLY * misfit < other for other in others) and same_content

    undirected = turn_shape(np.hypot(signal.ax, signal.ay)[None], recording.rate, recording.periods.loop_hz)
    scales = [record.scales.get(axis, (0.0, 1.0)) for _, axis in own]
    without_gravity = False
    if record.ay.min() >= 0 > signal.ay.min() and explains(_misfit(shape[:1], [undirected])):
        problem = "ay is never below 0, as the size of the acceleration, which has no direction"
        sentence = f"{problem}; name the column of the axis, `axes: {{ay: NAME}}`"
    elif explains(shifted, exchanged, filtered):
        shifts = (shape[:, 0] - forms[0][:, 0]).real
        axes = zip(own, shifts, scales, strict=True)
        zeros = [f"{axis}: {zero + g / unit:.5g}" for (_, axis), g, (zero, unit) in axes if abs(g) > LEAST_G]
        problem = f"gravity turns in its axes as in the simulated ones, but ay lies {shifts[0]:.3g} g off"
        sentence = f"{problem}: the value of the file that is 0 g may be another one, `zero: {{{', '.join(zeros)}}}`"
    elif without_gravity := explains(filtered, exchanged, ay=record.ay):
        problem = f"gravity is missing, as behind a high-pass filter of about {corner_hz:.2g} Hz"
        sensor = "an AC-coupled (IEPE) sensor, or one whose gravity was filtered out"
        sentence = f"{problem}: {sensor}; only high_frequency_g compares"
    elif explains(fitted, exchanged, shifted, ay=factor * back):
        causes, remedies = [], []
        if abs(angle) >= LEAST_DEG:
            causes.append(f"its axes are turned by {abs(angle):g} deg about z")
            remedies.append(f"turn them back, `turn: {(record.turn + angle + 180) % 360 - 180:g}deg`, or the sensor")
        if abs(np.log(factor)) > np.log(LEAST_FACTOR):
            likely = min(LIKELY_FACTORS, key=lambda other: abs(np.log(other / factor)))
            factor = likely if abs(np.log(likely / factor)) < SAME_FACTOR else factor
            causes.append(f"gravity turns with {1 / factor:.3g} of its size")
            remedies.append(f"check range and unit, perhaps `scale: {1 / abs(factor * scales[0][1]):.6g}`")
        sentence = f"{' and '.join(causes)} (misfit {fitted:.2g} g, as read {as_read:.2g} g): {'; '.join(remedies)}"
    elif explains(exchanged):
        changed = [(axis, chosen) for (_, axis), chosen in zip(own, best, strict=True) if chosen != (1, axis)]
        names = ", ".join(f"{axis}: {_column(record, *chosen)}" for axis, chosen in changed)
        would = f"with `axes: {{{names}}}` they would (misfit {exchanged:.2g} g, as read {as_read:.2g} g)"
        sentence = f"its axes do not turn through gravity as the simulated ones do, but {would}"
    elif CLEARLY * (misfit := _misfit(shape[:1], forms)) > (size := float(np.linalg.norm(forms[0][0]))):
        problem = "ay does not turn through gravity as the simulated y acceleration does"
        remedy = "check its column and sign (`axes: {ay: NAME}`, `axes: {ay: -NAME}`), and its unit"
        sentence = f"{problem} (misfit {misfit:.2g} of {size:.2g} g); {remedy}"
        if explains(filtered, exchanged):
            sentence += "; or gravity is missing (an AC-coupled or IEPE sensor): only high_frequency_g compares"
    else:
        return "", False
    return f"{record.path}: {sentence}", without_gravity


def require_axes(record: SensorRecord, rig: Rig, motor_rpm: float) -> None:
    """Refuse (`InputError`) a record whose axes do not fit (`judge_axes`) those of a belt at this speed (rev/min)."""
    scene = Scene(rig, motor_rpm, ring_radius=None, chain="belt", contact_log=False)
    turn = scene.with_(duration=whole_samples(rig.rate, scene.periods.loop))
    if doubt := judge_axes(belt_recording(turn), record)[0]:
        raise InputError(doubt)


def _column(record: SensorRecord, sign: int, axis: str) -> str:
    """Return the column of an axis as a mapping in YAML names it, with its sign flipped if ``sign`` is -1."""
    name = record.columns.get(axis, axis)
    name = name if sign > 0 else name[1:] if name.startswith("-") else f"-{name}"
    return name if re.fullmatch(r"-?\w+", name) else "'" + name.replace("'", "''") + "'"
