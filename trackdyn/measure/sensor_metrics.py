"""Measures of one sensor's record, simulated or measured: each with its standard error."""

from functools import partial

import numpy as np

from trackdyn.measure.sensor import own_loop_hz, whole_revolutions
from trackdyn.measure.uncertainty import LineError, line_error
from trackdyn.sensor.signals import (
    high_frequency_rms,
    high_passed,
    holds_line,
    main_line,
    main_line_binfree,
    rms,
    standard_deviation,
    uncertainty,
)

NAN = float("nan")


def sensor_metrics(ay, rate: float, loop_hz: float) -> dict:
    """RMS and SD, of the record and of its whole loop revolutions, dominant peak and high-frequency content of ay in g.

    Each stands before its standard error over revolutions of the loop (`signals.uncertainty`,
    `uncertainty.line_error`). The whole revolutions are those that the errors of the record are taken from, too, and
    the content from 20 Hz on: some parts of a turn have more of it than others. Lines and errors are NaN where the
    record holds fewer than two revolutions.
    """
    ay = np.asarray(ay)
    has_line = holds_line(len(ay), rate, loop_hz) and bool(np.ptp(ay))
    line = main_line(ay, rate, loop_hz) if has_line else (NAN, NAN)
    free = main_line_binfree(ay, rate, expected_hz=loop_hz)[:2] if has_line else (NAN, NAN)
    off = line_error(ay, rate, line[0], free[0]) if has_line else LineError(NAN, NAN, NAN, NAN)
    turns = ay[: whole_revolutions(len(ay), rate, loop_hz)]
    complete = turns if has_line else ay
    shorter = len(ay) / rate * loop_hz < 1  # than a revolution

    def error(statistic) -> float:
        return uncertainty(ay, rate, 1 / loop_hz, statistic)[1] if has_line else NAN

    rms_error, sd_error = error(rms), error(standard_deviation)
    return {
        "rms_g": rms(ay),
        "rms_error_g": rms_error,
        "sd_g": standard_deviation(ay),
        "sd_error_g": sd_error,
        "rms_whole_g": rms(complete),
        "rms_whole_error_g": rms_error,
        "sd_whole_g": standard_deviation(complete),
        "sd_whole_error_g": sd_error,
        "line_hz": line[0],
        "line_error_hz": off.bin_hz,
        "line_g": line[1],
        "line_error_g": off.bin_amplitude,
        "line_hz_binfree": free[0],
        "line_error_hz_binfree": off.hz,
        "line_g_binfree": free[1],
        "line_error_g_binfree": off.amplitude,
        "high_frequency_g": rms(high_passed(ay, rate)) if shorter else high_frequency_rms(turns, rate),
        "high_frequency_error_g": error(partial(high_frequency_rms, rate_hz=rate)),
    }


def own_metrics(ay, rate: float, expected_hz: float) -> dict:
    """`sensor_metrics` of a record whose loop turns at a speed of its own (`sensor.own_loop_hz`)."""
    return sensor_metrics(ay, rate, own_loop_hz(ay, rate, expected_hz))
