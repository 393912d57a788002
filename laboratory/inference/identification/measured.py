"""Sensor's records as they are identified from: each with its speed, its features and their scatter."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag

from laboratory.inference.identification.experiment import MeasuredSpeed, scene_of_speed
from laboratory.inference.identification.features import (
    LEAST_TURNS,
    covariance,
    features,
    features_in_a_row,
    turn_statistics,
)
from laboratory.inference.identification.posterior import MeasuredRecords
from trackdyn.errors import InputError, naming
from trackdyn.measure.axes import require_axes
from trackdyn.measure.compare import whole_ratio
from trackdyn.measure.spectra import LOOP_HZ, highest_line, main_line_binfree
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Periods
from trackdyn.sensor.sensor_csv import SensorRecord, read_sensor_csv
from trackdyn.sensor.sensor_mapping import SensorMapping

SAME_SPEED = 1e-3  # two records that are nearer have one speed


@dataclass(frozen=True)
class Measured:
    """A record and what is taken from it."""

    record: SensorRecord  # as it is compared: averaged, if it is faster than the simulation by a whole factor
    speed: MeasuredSpeed  # the simulation beside it
    turn_s: float  # time of a turn of the loop, s
    statistics: np.ndarray  # (turns, features) `turn_statistics`

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        return self.record.path.stem


def read_records(
    paths: Sequence[Path | str],
    rig: Rig,
    mapping: SensorMapping,
    rpm: Sequence[float],
    ring_radius: float | None,
    preset: str,
) -> list[Measured]:
    """Read the records of a sensor at different speeds.

    The revolution of the loop is that of the dominant peak: the one near a given speed, or the highest one. Without
    ``rpm`` (rev/min) dominant peaks say the speeds. Measured stand in the order of the files.

    Raises
    ------
    InputError
        A file is invalid, a record is too short, two records have the same name or speed, or no scene can be simulated
        beside one.
    """
    if rpm and len(rpm) != len(paths):
        raise InputError(
            f"--rpm is given {len(rpm)} times for {len(paths)} records; give it once per record, or not at all"
        )
    mapping = mapping.sensors.get(next(iter(rig.sensors)), mapping)
    records = [
        _measured(read_sensor_csv(path, mapping, rig.first_sensor.range, rig.g), rig, speed, ring_radius, preset)
        for path, speed in zip(paths, rpm or [None] * len(paths), strict=True)
    ]
    for k, measurement in enumerate(records):
        for other in records[:k]:
            if measurement.name == other.name:
                raise InputError(f"{measurement.record.path}: has the same name as {other.record.path}; rename it")
            if abs(measurement.speed.rpm / other.speed.rpm - 1) < SAME_SPEED:
                raise InputError(
                    f"{measurement.record.path}: has the same speed as {other.record.path}, "
                    f"{measurement.speed.rpm:.5g} rev/min; leave one out, or join them in one file"
                )
        scene_of_speed(rig, measurement.speed, measurement.turn_s)
    return records


def _measured(record: SensorRecord, rig: Rig, rpm: float | None, ring_radius: float | None, preset: str) -> Measured:
    a_turn_at_1_rpm = Periods.at(rig, 1.0).loop
    expected = None
    if rpm is not None:
        if not (np.isfinite(rpm) and rpm > 0):
            raise InputError(f"--rpm {rpm:g}: must be a motor speed above 0 rev/min")
        expected = rpm / a_turn_at_1_rpm
        record.require_turns(1 / expected, LEAST_TURNS)
    low, high = LOOP_HZ if expected is None else (0.9 * expected, 1.1 * expected)
    if record.seconds < LEAST_TURNS / high:
        raise InputError(
            f"{record.path}: the record of {record.seconds:.4g} s is too short to tell {LEAST_TURNS} turns of the loop"
        )
    with naming(record.path):
        line = highest_line(record.ay_g, record.rate_hz, low, high)[0]
        loop_hz = main_line_binfree(record.ay_g, record.rate_hz, expected or line)[0]
    record.require_turns(1 / loop_hz, LEAST_TURNS)
    require_axes(record, rig, rpm or loop_hz * a_turn_at_1_rpm)
    try:
        faster, slower = whole_ratio(record, rig.rate)
        rate = rig.rate
    except InputError:  # the simulation takes the rate of the record
        faster, slower, rate = 1, 1, round(record.rate_hz)
    record = record.averaged(faster)
    speed = MeasuredSpeed(rpm or loop_hz * a_turn_at_1_rpm, ring_radius, rate, slower, preset)
    statistics = turn_statistics(record.ay_g, record.rate_hz, 1 / loop_hz, rig.chain.pitches)
    return Measured(record, speed, 1 / loop_hz, statistics)


def joined(statistics: Sequence[np.ndarray], speeds: Sequence[MeasuredSpeed]) -> MeasuredRecords:
    """The features of several records in a row, from the `turn_statistics` of each."""
    rates = [speed.record_rate for speed in speeds]
    names, record = features_in_a_row(rates)
    scatter = block_diag(*map(covariance, statistics, rates))
    return MeasuredRecords(names, record, np.concatenate(list(map(features, statistics, rates))), scatter)
