"""Acceleration sensor on the link (Eq. 40): sampling, range, and the loop frequency of its record."""

from dataclasses import dataclass
from html import escape
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from trackdyn.inputs.validation import typed, within
from trackdyn.measure.spectra import highest_line, holds_line, main_line_binfree
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.signals import sensor_signal

if TYPE_CHECKING:
    import pandas as pd

OTHER_SPEED = 4.0  # largest ratio of the speeds of a sensor's record and of a run that is compared with it


@dataclass(frozen=True)
class SensorSignal:
    """Record of an acceleration sensor on the chain."""

    time: np.ndarray  # (s,) sample times, s
    # (s,) accelerations along its body and along the outward normal, g: means over the sample interval that ends at the
    # sample, clipped at the range
    ax: np.ndarray
    ay: np.ndarray
    rate: float  # sampling rate, Hz
    clipped: int  # number of clipped samples of ``ax`` and ``ay``

    def __repr__(self) -> str:
        """Return one line: length, rate, and RMS of both accelerations."""
        rms = ", ".join(f"{name} {np.sqrt(np.mean(getattr(self, name) ** 2)):.4g} g RMS" for name in ("ax", "ay"))
        return f"<SensorSignal: {len(self.time)} samples at {self.rate:g} Hz; {rms}; {self.clipped} clipped>"

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self)[1:-1])}</p>{self.to_frame()._repr_html_()}"

    def plot(self, ax: Any = None) -> Any:
        """Plot both accelerations over time, in a new figure by default, and return the axes.

        ``axes.figure.savefig("acceleration.png")`` writes them.
        """
        import pandas as pd  # takes half a second, which runs do not need

        named = {"ay, along the outward normal of the link": self.ay, "ax, along the link": self.ax}
        labels = {"xlabel": "time (s)", "ylabel": "acceleration (g)", "title": "Sensor on the link"}
        return pd.DataFrame(named, index=self.time).plot(ax=ax, **labels)

    def to_frame(self) -> "pd.DataFrame":
        """Return times (s) and accelerations (g) as a table of ``t_s, ax_g, ay_g``."""
        import pandas as pd

        return pd.DataFrame({"t_s": self.time, "ax_g": self.ax, "ay_g": self.ay})


@typed
def sense(recording: Recording, every: int = 1, sensor: str | int = 0) -> SensorSignal:
    """Return the signal of a sensor: the acceleration of Eq. (40) in g, clipped at its range.

    Parameters
    ----------
    recording : Recording
        Run of S samples.
    every : int
        Samples of the recording per sample of the sensor, which is their mean: a sensor of a lower rate.
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
    free = sensor_signal(motion, recording.scene.rig)
    ax, ay = np.clip(free, -limit, limit).T
    clipped = int((np.abs(free) > limit).sum())
    return SensorSignal(recording.time[every - 1 :: every], ax, ay, recording.rate / every, clipped)


def whole_samples(rate: float, seconds: float) -> float:
    """Round ``seconds`` up to whole samples; return the duration, s."""
    return ceil(seconds * rate - 1e-6) / rate


def whole_revolutions(count: int, rate: float, loop_hz: float) -> int:
    """Return the number of samples, of ``count`` at ``rate`` (Hz), in whole revolutions of the loop; all if none is."""
    loops = np.floor(count / rate * loop_hz + 1e-6)
    return round(loops / loop_hz * rate) if loops else count


def measured_loop_hz(ay, rate: float, expected_hz: float) -> float:
    """Return the frequency of the loop (Hz) from the dominant peak of a record; bin-free, if it has two turns.

    It is within a factor of four of ``expected_hz`` (Hz), which is returned for a record of fewer than two such turns.
    """
    if not holds_line(len(ay), rate, expected_hz):
        return expected_hz
    hz = highest_line(ay, rate, expected_hz / OTHER_SPEED, expected_hz * OTHER_SPEED)[0]
    return main_line_binfree(ay, rate, hz)[0] if holds_line(len(ay), rate, hz) else hz
