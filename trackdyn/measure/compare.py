"""A simulated record beside a sensor's: the rows of Table 3 and the lines of Figure 18."""

import pandas as pd

from trackdyn.errors import InputError
from trackdyn.measure.metrics import loop_frequency, sensor_metrics
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.measure.signals import main_line
from trackdyn.recording import Recording

COMPARED = ("rms_g", "sd_g", "line_hz", "line_g", "line_hz_binfree", "line_g_binfree", "high_frequency_g")


def compare_with_sensor(recording: Recording, record: SensorRecord) -> pd.DataFrame:
    """Measures of both records and their difference.

    Returns
    -------
    DataFrame
        ``measure, simulation, sensor, difference_pct`` with the paper's value difference
        ``|simulation - sensor| / sensor``.

    Raises
    ------
    InputError
        If the two records have different sampling rates.
    """
    if abs(record.rate_hz / recording.rate - 1) > 1e-6:
        raise InputError(
            f"{record.path}: has {record.rate_hz:g} samples a second, the recording {recording.rate:g}; "
            "simulate with the sensor's rate (sensor.rate of the rig)"
        )
    simulated = sensor_metrics(sense(recording).ay, recording.rate, loop_frequency(recording))
    # the sensor's loop turns at its own speed, which need not be the one that was asked for
    own_line = main_line(record.ay_g, record.rate_hz)[0]
    measured = sensor_metrics(record.ay_g, record.rate_hz, own_line)
    rows = []
    for name in COMPARED:
        a, b = simulated[name], measured[name]
        rows.append(
            {"measure": name, "simulation": a, "sensor": b, "difference_pct": 100 * abs(a - b) / abs(b) if b else None}
        )
    return pd.DataFrame(rows)
