"""The sensor's records as they are compared, and the conversions made in reading them."""

from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd

from trackdyn.fieldtest.axes import require_axes
from trackdyn.fieldtest.samples import whole_ratio
from trackdyn.fieldtest.sensor_csv import read_sensor, write_sensor_csv
from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.spectra import LEAST_PERIODS
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Periods


@run_job
def main(job) -> None:
    """Rule `sensor_records`."""
    params, mapping, rows = job.params, load_mapping(*job.input.mapping), []
    rig = load_rig(job.input.rig)
    mapping = mapping.sensors.get(next(iter(rig.sensors)), mapping)
    origin = "synthetic, not measured" if params.synthetic else "as compared"
    for rpm, path, out in zip(params.speeds, job.input.sensors, job.output.records, strict=True):
        record = read_sensor(path, mapping, rig.first_sensor.range, rig.g)
        record.require_turns(Periods.at(rig, rpm).loop, LEAST_PERIODS)
        require_axes(record, rig, rpm)
        if record.rate < rig.rate and whole_ratio(rig.rate, record.rate) != 1:
            raise InputError(
                f"{path}: has {record.rate:.6g} samples per second, fewer than the simulation's {rig.rate:g}; "
                f"set sensor.rate of the rig to {round(record.rate)}"
            )
        record = record.averaged(rig.rate)
        rows.append({"speed_rpm": rpm, "file": path, **record.done})
        comments = [f"{path}: {origin}", *(f"{name}: {text}" for name, text in record.done.items())]
        write_sensor_csv(out, record.time, record.ax, record.ay, record.az, comments)
    write_csv(job.output.csv, pd.DataFrame(rows))
