"""Tables 1, 3 and 4, the parameters, the sensor's records, and dominant peaks of both and as printed."""

from trackdyn.sweeps.snakemake_job import run_job

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import zip_longest
from math import inf, nan

import numpy as np
import pandas as pd

from trackdyn.fieldtest.axes import require_axes
from trackdyn.fieldtest.samples import whole_ratio
from trackdyn.fieldtest.sensor_csv import SensorRecord, read_sensor, write_sensor_csv
from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.columns import described
from trackdyn.measure.estimators import sensor_metrics
from trackdyn.measure.sensor import measured_loop_hz
from trackdyn.measure.spectra import LEAST_PERIODS
from trackdyn.rig.groove import Groove
from trackdyn.rig.rig import load_rig, parameter_table
from trackdyn.scene.scene import Periods
from trackdyn_replication.paper import published
from trackdyn_replication.paper.published import SENSORS, value_difference

Sensors = Mapping[float, SensorRecord | None]


def table1(groove: Groove) -> pd.DataFrame:
    """Tabulate the geometry of the ten areas: ``area, type, O_x_mm, O_y_mm, r_mm, u_x, u_y, theta_deg, length_mm``."""
    table = pd.DataFrame({"area": np.arange(1, 11), "type": np.where(groove.convex, "convex", "concave")})
    table[["O_x_mm", "O_y_mm"]] = 1e3 * groove.centre + 0.0  # no -0
    table["r_mm"] = 1e3 * groove.radius
    table[["u_x", "u_y"]] = groove.direction
    table["theta_deg"] = np.degrees(groove.half_angle)
    table["length_mm"] = 2e3 * groove.radius * groove.half_angle
    return table


def _pairs(metrics: pd.DataFrame, sensors: Sensors) -> Iterator[tuple[float, pd.Series, dict | None]]:
    """Yield speed, metrics of the simulation, and those of the sensor's record, None where there is none."""
    runs = metrics.set_index("rpm")
    for rpm, record in sorted(sensors.items()):
        signal = record and (record.ay, record.rate)
        run = runs.loc[rpm]
        yield rpm, run, signal and sensor_metrics(*signal, measured_loop_hz(*signal, run["line_hz_binfree"]))


def table3(metrics: pd.DataFrame, sensors: Sensors, label: str = "synthetic sensor") -> pd.DataFrame:
    """Compare RMS and SD of simulation and sensor over whole turns of the loop, g, with the paper's own differences."""
    rows = []
    for rpm, run, measured in _pairs(metrics, sensors):
        sensor = measured or defaultdict(lambda: nan)
        row = {"speed_rpm": rpm, "sensor_record": label}
        for name, paper in published.DIFFERENCES.items():
            simulated, error = float(run[f"{name}_g"]), float(run[f"{name}_error_g"])
            measured, standard_error = sensor[f"{name}_g"], sensor[f"{name}_error_g"]
            row |= {
                f"{name}_simulation_g": simulated, f"{name}_standard_error_g": error,
                f"{name}_sensor_g": measured, f"{name}_sensor_error_g": standard_error,
                f"{name}_difference_pct": value_difference(simulated, measured),
                f"{name}_difference_error_pct": 100 * ratio_of_runs(simulated, error, measured, standard_error)[1],
                f"{name}_difference_printed_against_papers_own_data_pct": paper.get(rpm, nan),
            }  # fmt: skip
        rows.append(row)
    return pd.DataFrame(rows)


def ratio_of_runs(value: float, error: float, base: float, base_error: float) -> tuple[float, float]:
    """Return the ratio of independent results and its standard error, to first order (JCGM 100:2008, 5.1.2)."""
    ratio = value / base if base else nan
    return ratio, float(np.hypot(error, ratio * base_error) / abs(base)) if base else nan


def lines_table(metrics: pd.DataFrame, sensors: Sensors, label: str = "synthetic sensor") -> pd.DataFrame:
    """Tabulate the dominant peaks, two rows a speed: simulation and sensor, each with its printed value."""
    rows = []
    names = {  # of a column here, and in `measure.estimators.sensor_metrics`
        f"line_{prefix}{name}": f"line_{name}{ending}"
        for name in ("hz", "error_hz", "g", "error_g")
        for prefix, ending in (("", ""), ("binfree_", "_binfree"))
    }
    for rpm, run, measured in _pairs(metrics, sensors):
        for source, of_paper, line in (("simulation", "simulation", run), (label, "experiment", measured)):
            if line is not None:
                row = {"speed_rpm": rpm, "source": source}
                row |= {name: float(line[column]) for name, column in names.items()} | {"printed_of_papers": of_paper}
                hz, g, _ = published.LINES[of_paper]
                rows.append(row | {"line_printed_hz": hz.get(rpm, nan), "line_printed_g": g.get(rpm, nan)})
    return pd.DataFrame(rows)


def table4(metrics: pd.DataFrame, speeds: Iterable[float]) -> pd.DataFrame:
    """Compare RMS and SD of three tooth surfaces and ten arcs: Table 4 without the lost comparison."""
    rows = []
    table = metrics.set_index("run")
    for rpm in speeds:
        fine, coarse = table.loc[f"{rpm:g}rpm"], table.loc[f"coarse/{rpm:g}rpm"]
        row = {"rpm": rpm}
        for name in ("rms_g", "sd_g", "left_rms_n"):
            error = described(name)[3]
            row |= {f"{name}_ten_arcs": fine[name], f"{name}_ten_arcs_error": fine[error]}
            row |= {f"{name}_three_surfaces": coarse[name], f"{name}_three_surfaces_error": coarse[error]}
            ratio, ratio_error = ratio_of_runs(coarse[name], coarse[error], fine[name], fine[error])
            row |= {f"{name}_difference_pct": 100 * (ratio - 1), f"{name}_difference_error_pct": 100 * ratio_error}
        rows.append(row)
    return pd.DataFrame(rows)


def sensor_records(job) -> pd.DataFrame:
    """Write the sensor's records as they are compared; return the conversions made in reading them."""
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
    return pd.DataFrame(rows)


@run_job
def main(job) -> None:
    """Rules `parameters`, `sensor_records` and `statistics`."""
    params, output = job.params, job.output
    if job.rule == "parameters":
        write_csv(output.csv, parameter_table(job.input.rig))
        write_csv(output.groove, table1(load_rig(job.input.rig).groove_profile))
        return
    if job.rule == "sensor_records":
        write_csv(output.csv, sensor_records(job))
        return
    label, metrics = SENSORS[params.synthetic], pd.read_csv(job.input.metrics)
    records = metrics.set_index("run").loc[params.runs].reset_index()
    paths = zip_longest(params.speeds, job.input.get("sensors", ()))
    sensors = {rpm: read_sensor(path, range_g=inf) if path else None for rpm, path in paths}
    write_csv(output.csv, table3(records, sensors, label))
    write_csv(output.lines, lines_table(records, sensors, label))
    write_csv(output.coarse, table4(metrics, params.speeds))
