"""One row of numbers a run: the columns of ``metrics.csv``."""

from functools import partial

import numpy as np
import pandas as pd

from trackdyn.fidelity import label
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.sensor import sense
from trackdyn.measure.signals import (
    high_frequency_rms,
    main_line,
    main_line_binfree,
    rms,
    standard_deviation,
    uncertainty,
)
from trackdyn.measure.uncertainty import LineError, line_error
from trackdyn.model.record import ENERGY_NAMES
from trackdyn.recording import Recording

NAN = float("nan")
# The bin-free line needs the record to hold a few revolutions of the loop.
LEAST_LOOPS = 2.0
LOSSES = ("tooth_normal", "tooth_friction", "wheel_normal", "wheel_friction", "bearing", "bushing_loss")
STORED = ("kinetic", "gravity", "bushing_elastic")
STARTS = 16  # of a record in a turn of the loop


def loop_frequency(recording: Recording) -> float:
    """Revolutions of the loop per second that the motor speed asks for, Hz."""
    rig = recording.meta["rig"]
    sprocket = recording.meta["scene"]["motor_rpm"] / rig["sprocket"]["transmission_ratio"] / 60
    return sprocket * rig["sprocket"]["teeth"] / rig["chain"]["pitches"]


def energy_residual(recording: Recording) -> float:
    """What the account of work leaves open, as a share of the sprocket's work over the record.

    Work of the sprocket minus every dissipation minus the change of kinetic, gravitational and
    bushing energy. The work absorbed by normal contact counts as one term: what Eq. 8 stores comes
    back through it.
    """
    change = dict(zip(ENERGY_NAMES, recording.energy[-1] - recording.energy[0], strict=True))
    work = change["sprocket_work"]
    rest = work - sum(change[name] for name in LOSSES) - sum(change[name] for name in STORED)
    return rest / work if work else NAN


def whole_revolutions(count: int, rate: float, loop_hz: float) -> int:
    """Samples of a record that make whole revolutions of the loop; all of them if it holds none."""
    loops = np.floor(count / rate * loop_hz + 1e-6)
    return round(loops / loop_hz * rate) if loops else count


def lines_by_start(recording: Recording, starts: int = STARTS) -> pd.DataFrame:
    """Main line of the FFT, had the record begun elsewhere in a turn of the loop.

    What a later start needs beyond the end of the record is taken one turn earlier: in steady running every turn
    is like the one before. Windows of a longer run show the same amplitudes to 5e-6 g (115 rpm, 90 s).

    Returns
    -------
    DataFrame
        ``start_s`` after the record's own start, ``line_hz``, ``line_g``; no rows for a record too short for a line.
    """
    ay, loop_hz = sense(recording).ay, loop_frequency(recording)
    if loop_hz <= 0 or len(ay) / recording.rate * loop_hz < LEAST_LOOPS:
        return pd.DataFrame(columns=["start_s", "line_hz", "line_g"])
    turn = round(recording.rate / loop_hz)
    longer = np.concatenate([ay, ay[-turn:]])
    rows = []
    for first in np.rint(np.arange(starts) / starts * turn).astype(int):
        line = main_line(longer[first : first + len(ay)], recording.rate)
        rows.append({"start_s": first / recording.rate, "line_hz": line[0], "line_g": line[1]})
    return pd.DataFrame(rows)


def sensor_metrics(ay, rate: float, loop_hz: float) -> dict:
    """RMS and SD, of the record and of its whole loop revolutions, main line and high-frequency content of ay in g.

    Each stands before its standard error over revolutions of the loop (`signals.uncertainty`, `uncertainty.line_error`).
    The whole revolutions are those that the errors of the record are taken from, too. Lines and errors are NaN where the
    record holds fewer than two revolutions.
    """
    ay = np.asarray(ay)
    loops = len(ay) / rate * loop_hz
    has_line = loop_hz > 0 and loops >= LEAST_LOOPS
    line = main_line(ay, rate) if has_line else (NAN, NAN)
    free = main_line_binfree(ay, rate, expected_hz=loop_hz)[:2] if has_line else (NAN, NAN)
    off = line_error(ay, rate, line[0], free[0]) if has_line else LineError(NAN, NAN, NAN, NAN)
    whole = ay[: whole_revolutions(len(ay), rate, loop_hz)] if has_line else ay

    def error(statistic) -> float:
        return uncertainty(ay, rate, 1 / loop_hz, statistic)[1] if has_line else NAN

    rms_error, sd_error = error(rms), error(standard_deviation)
    return {
        "rms_g": rms(ay),
        "rms_error_g": rms_error,
        "sd_g": standard_deviation(ay),
        "sd_error_g": sd_error,
        "rms_whole_g": rms(whole),
        "rms_whole_error_g": rms_error,
        "sd_whole_g": standard_deviation(whole),
        "sd_whole_error_g": sd_error,
        "line_hz": line[0],
        "line_error_hz": off.bin_hz,
        "line_g": line[1],
        "line_error_g": off.bin_amplitude,
        "line_hz_binfree": free[0],
        "line_error_hz_binfree": off.hz,
        "line_g_binfree": free[1],
        "line_error_g_binfree": off.amplitude,
        "high_frequency_g": high_frequency_rms(ay, rate),
        "high_frequency_error_g": error(partial(high_frequency_rms, rate_hz=rate)),
    }


def run_metrics(name: str, recording: Recording) -> dict:
    """The row of a run: what ran, what it cost, what the sensor and the contacts show."""
    scene = recording.meta["scene"]
    signal = sense(recording)
    radius = scene["ring_radius"]
    seconds = len(recording.time) / recording.rate
    cut = getattr(recording, "cut", np.zeros((0, 2)))
    gaps = cut.max(axis=0) if len(cut) else (NAN, NAN)
    return {
        "run": name,
        "rpm": scene["motor_rpm"],
        "ring_radius_m": NAN if radius is None else radius,
        "fidelity": label(recording.meta["fidelity"]),
        "step_s": scene["step"],
        "simulated_s": seconds,
        "wall_s": recording.wall,
        **sensor_metrics(signal.ay, recording.rate, loop_frequency(recording)),
        "loop_gap_max_m": float(recording.gap.max()),
        "gap_before_projection_m": float(gaps[0]),
        "velocity_gap_m_s": float(gaps[1]),
        "energy_residual": energy_residual(recording),
        "clipped_samples": signal.clipped,
        **meshing_summary(recording),
    }
