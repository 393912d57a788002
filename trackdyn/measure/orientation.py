"""Whether a sensor's axes are those of the simulation: gravity turns in them once a turn of the loop (Eq. 40)."""

import shlex
from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from trackdyn.errors import InputError
from trackdyn.measure.sensor import OTHER_SPEED, own_loop_hz, sense, whole_samples
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.sensor.signals import highest_line
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import Recording

HARMONICS = 3  # of the loop's frequency; in a loop of straight runs these hold nearly all of gravity
LEAST_G = 0.1  # zero offset of a cheap sensor: a smaller difference tells nothing
CLEARLY = 2.0  # times better


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


def doubtful_axes(recording: Recording, record: SensorRecord) -> str | None:
    """What seems wrong with the axes of a sensor's record, and which ``--axis`` fit; None if nothing does.

    Compared are mean and first harmonics of the loop's frequency, over a turn at least, in y, and in x where the record
    has it: gravity crosses the axes in an order that a flipped or exchanged one reverses, and the mean of y points
    inwards. A loop that runs the other way round, as its mirror image does, is not doubted.
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
    hz = own_loop_hz(strongest, record.rate_hz, hz)

    def misfit(chosen: Sequence[tuple[int, str]]) -> float:
        shape = turn_shape(np.array([sign * measured[name] for sign, name in chosen]), record.rate_hz, hz)
        return float(min(np.linalg.norm(shape - wanted[: len(shape)]) for wanted in (simulated, mirrored)))

    scores = {
        turn_of: misfit(turn_of)
        for chosen in permutations(measured, len(names))
        for signs in product((1, -1), repeat=len(names))
        for turn_of in [tuple(zip(signs, chosen, strict=True))]
    }
    read = scores[tuple((1, name) for name in names)]
    best = min(scores, key=scores.__getitem__)
    if read > CLEARLY * scores[best] and read - scores[best] > LEAST_G:
        options = " ".join(
            f"--axis {shlex.quote(f'{axis}={_column(record, sign, name)}')}"
            for axis, (sign, name) in zip(names, best, strict=True)
            if (sign, name) != (1, axis)
        )
        return (
            f"{record.path}: its axes do not turn through gravity as the simulated ones do, but with {options} they "
            f"would (misfit {scores[best]:.2g} g, as read {read:.2g} g)"
        )
    size = np.linalg.norm(simulated[0])
    if CLEARLY * (alone := misfit([(1, "ay")])) > size:
        return (
            f"{record.path}: ay does not turn through gravity as the simulated y acceleration does (misfit {alone:.2g} "
            f"of {size:.2g} g); check its column and sign (--axis ay=NAME, ay=-NAME), and its unit"
        )
    return None


def require_axes(record: SensorRecord, rig: Rig, motor_rpm: float) -> None:
    """Refuse a record with doubtful axes before anything is simulated: links on a belt turn through gravity, too.

    Parameters
    ----------
    record : SensorRecord
        Record of one turn of the loop at least.
    rig : Rig
        Rig that the record is compared with.
    motor_rpm : float
        Speed of its motor, rev/min.

    Raises
    ------
    InputError
        `doubtful_axes` doubts the axes.
    """
    scene = Scene(rig, motor_rpm, ring_radius=None, chain="belt", spells=False)
    turn = whole_samples(rig.sensor.rate, scene.periods.loop)
    if doubt := doubtful_axes(belt_recording(scene.with_(duration=turn)), record):
        raise InputError(f"{doubt}; in the pipeline, state axes in the file that sensor_mapping names")


def _column(record: SensorRecord, sign: int, axis: str) -> str:
    """Column of an axis as ``--axis`` takes it, with its sign turned if ``sign`` is -1."""
    name = record.columns.get(axis, axis)
    return name if sign > 0 else name[1:] if name.startswith("-") else f"-{name}"
