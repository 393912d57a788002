"""The acceleration sensor on the link (Eq. 40), its sampling and its range, and the measures of its record."""

from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from trackdyn.measure.spectra import (
    high_frequency_rms,
    high_passed,
    highest_line,
    holds_line,
    main_line,
    main_line_binfree,
    rms,
    standard_deviation,
)
from trackdyn.measure.uncertainty import NAN, LineError, line_error, turn_error
from trackdyn.rig.rig import Rig
from trackdyn.rig.validation import typed, within
from trackdyn.simulation.recording import Recording

OTHER_SPEED = 4.0  # largest ratio of the speeds of a sensor's record and of a run beside it


@dataclass(frozen=True)
class SensorSignal:
    """The record of an acceleration sensor on the chain."""

    time: np.ndarray  # (s,) sample times, s
    # ax, ay: (s,) along its body and along the outward normal, g; the mean over the sample interval that ends at the
    # sample, limited to the range
    ax: np.ndarray
    ay: np.ndarray
    rate: float  # sampling rate, Hz
    clipped: int  # number of samples of ``ax`` and ``ay`` that the range cut

    def plot(self, axes: Any = None) -> Any:
        """Draw both accelerations over time.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; by default a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            With labels, units and a legend; ``axes.figure.savefig("acceleration.png")`` writes it.
        """
        import pandas as pd  # half a second that a run does without

        named = {"ay, along the outward normal of the link": self.ay, "ax, along the link": self.ax}
        labels = {"xlabel": "time (s)", "ylabel": "acceleration (g)", "title": "Sensor on the link"}
        return pd.DataFrame(named, index=self.time).plot(ax=axes, **labels)


def specific_force(acceleration: ArrayLike, angle: ArrayLike, gravity: float = 9.81) -> np.ndarray:
    """Eq. (40): ``a_t = a_s + A_t^T G``, (..., 2) in the link frame, m/s2; +gravity along y at rest on a level link.

    ``acceleration`` (..., 2) of the sensor's point is in the link frame already, m/s2; ``angle`` (...) is that of the
    link's x axis, rad.
    """
    projection = np.stack([np.sin(angle), np.cos(angle)], axis=-1) * gravity
    return np.asarray(acceleration, dtype=float) + projection


def readings(motion: np.ndarray, rig: Rig, limit: float = np.inf) -> np.ndarray:
    """(..., 2) what sensors report (Eq. 40), along their bodies and along the outward normals, g, up to ``limit`` (g).

    ``motion`` (..., 3) holds accelerations (m/s2) and angles (rad) as in `Recording.mean`.
    """
    return np.clip(specific_force(motion[..., :2], motion[..., 2], rig.gravity) / rig.g, -limit, limit)


@typed
def sense(recording: Recording, every: int = 1, sensor: str | int = 0) -> SensorSignal:
    """Return what a sensor shows: the acceleration of Eq. (40) in g, limited to its range.

    Parameters
    ----------
    recording : Recording
        Run of S samples.
    every : int
        Samples of the recording per sample of the sensor: their mean is the sample of a sensor whose rate is lower by
        this factor.
    sensor : str or int
        Name of the sensor in ``recording.sensors``, or its index there.

    Returns
    -------
    SensorSignal
        ``S // every`` samples: times in s, accelerations in g.

    Raises
    ------
    InputError
        ``every`` is out of range, or the recording has no sensor of that name or number.
    """
    every = int(within("every", every, 1, max(len(recording.time), 1), " samples"))
    index = recording.sensor_index(sensor)
    limit = list(recording.sensors.values())[index].range
    motion = recording.mean[: len(recording.mean) // every * every, index].reshape(-1, every, 3).mean(axis=1)
    free = readings(motion, recording.scene.rig)
    ax, ay = np.clip(free, -limit, limit).T
    clipped = int((np.abs(free) > limit).sum())
    return SensorSignal(recording.time[every - 1 :: every], ax, ay, recording.rate / every, clipped)


def whole_samples(rate: float, seconds: float) -> float:
    """The shortest duration (s) of whole samples that is not below ``seconds``."""
    return ceil(seconds * rate - 1e-6) / rate


def whole_revolutions(count: int, rate: float, loop_hz: float) -> int:
    """How many of ``count`` samples at ``rate`` (Hz) make whole revolutions of the loop; all if they hold none."""
    loops = np.floor(count / rate * loop_hz + 1e-6)
    return round(loops / loop_hz * rate) if loops else count


def measured_loop_hz(ay, rate: float, expected_hz: float) -> float:
    """Turns of the loop a second (Hz) that the dominant peak of a record shows; bin-free, if it holds two turns.

    The peak is looked for up to a factor of four from ``expected_hz`` (Hz), which is the answer for a record of fewer
    than two of such turns: its lines are too far apart.
    """
    if not holds_line(len(ay), rate, expected_hz):
        return expected_hz
    hz = highest_line(ay, rate, expected_hz / OTHER_SPEED, expected_hz * OTHER_SPEED)[0]
    return main_line_binfree(ay, rate, hz)[0] if holds_line(len(ay), rate, hz) else hz


def sensor_metrics(ay, rate: float, loop_hz: float) -> dict:
    """Columns of `columns` about the y acceleration ay in g, each before its standard error over revolutions.

    RMS, SD and content from 20 Hz on are those of whole revolutions, which the errors are taken from, too: parts of a
    turn differ. A record of less than one is taken as it is. Lines and errors are NaN where it holds fewer than two.
    """
    ay = np.asarray(ay)
    has_line = holds_line(len(ay), rate, loop_hz) and bool(np.ptp(ay))
    turns = ay[: whole_revolutions(len(ay), rate, loop_hz)]
    line = main_line(ay, rate, loop_hz) if has_line else (NAN, NAN)
    # a sample more: two turns are the least that has a line, and end between two samples
    free = main_line_binfree(ay[: len(turns) + 1], rate, expected_hz=loop_hz)[:2] if has_line else (NAN, NAN)
    errors = line_error(ay, rate, line[0], free[0]) if has_line else LineError(NAN, NAN, NAN, NAN, NAN)
    below_a_revolution = len(ay) / rate * loop_hz < 1

    def error(statistic) -> float:
        return turn_error(ay, 1 / loop_hz * rate, statistic) if has_line else NAN

    return {
        "rms_g": rms(turns),
        "rms_error_g": error(rms),
        "sd_g": standard_deviation(turns),
        "sd_error_g": error(standard_deviation),
        "line_hz": line[0],
        "line_error_hz": errors.bin_hz,
        "line_g": line[1],
        "line_error_g": errors.bin_amplitude,
        # harmonics beyond the fitted ones move the fit, by the phase at which a record begins, but no turn's phase
        "line_hz_binfree": free[0] + errors.beyond_hz,
        "line_error_hz_binfree": errors.hz,
        "line_g_binfree": free[1],
        "line_error_g_binfree": errors.amplitude,
        "high_frequency_g": rms(high_passed(ay, rate)) if below_a_revolution else high_frequency_rms(turns, rate),
        "high_frequency_error_g": error(partial(high_frequency_rms, rate_hz=rate)),
    }


def record_metrics(ay, rate: float, expected_hz: float) -> dict:
    """`sensor_metrics` of a record ``ay`` whose loop turns at a speed of its own, near ``expected_hz`` (Hz)."""
    return sensor_metrics(ay, rate, measured_loop_hz(ay, rate, expected_hz))
