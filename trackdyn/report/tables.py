"""Tables of the report: what each holds, and writing it as CSV and Markdown."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.measure.signals import main_line, main_line_binfree, rms, standard_deviation
from trackdyn.paper import printed
from trackdyn.parameters.groove import Groove
from trackdyn.replacing import replacing


def write_table(
    frame: pd.DataFrame, csv_path: Path | str, caption: str, digits: int = 5, shown: pd.DataFrame | None = None
) -> None:
    """Write a table as CSV in full precision, and beside it as Markdown with its caption, both without the index.

    The Markdown table has so many significant ``digits``; ``shown`` is another form of the table for it.
    """
    csv_path = Path(csv_path)
    csv_path.parent.mkdir(parents=True, exist_ok=True)
    shown = frame if shown is None else shown
    cells = shown.astype(object).where(shown.notna(), None)
    body = cells.to_markdown(index=False, floatfmt=f".{digits}g", missingval="–")
    with replacing(csv_path) as csv, replacing(csv_path.with_suffix(".md")) as markdown:
        csv.write_text(frame.to_csv(index=False, lineterminator="\n"), encoding="utf-8", newline="")
        markdown.write_text(f"{caption}\n\n{body}\n", encoding="utf-8", newline="")


def table1(groove: Groove) -> pd.DataFrame:
    """Geometry of the ten areas: ``area, type, O_x_mm, O_y_mm, r_mm, u_x, u_y, theta_deg``."""
    table = pd.DataFrame({"area": np.arange(1, 11), "type": np.where(groove.convex, "convex", "concave")})
    table[["O_x_mm", "O_y_mm"]] = 1e3 * groove.centre + 0.0  # no -0
    table["r_mm"] = 1e3 * groove.radius
    table[["u_x", "u_y"]] = groove.direction
    table["theta_deg"] = np.degrees(groove.half_angle)
    return table


def _row_of(metrics: pd.DataFrame, rpm: float) -> pd.Series:
    rows = metrics[np.isclose(metrics["rpm"].astype(float), rpm)]
    if len(rows) != 1:
        problem = f"metrics: {len(rows)} rows stand for {rpm:g} rpm"
        raise InputError(f"{problem}; give the one run that belongs to its sensor record")
    return rows.iloc[0]


def value_difference(simulation: float, sensor: float) -> float:
    """The paper's value difference ``|simulation - sensor| / sensor``, %."""
    return 100.0 * abs(simulation - sensor) / abs(sensor) if sensor else float("nan")


def table3(
    metrics: pd.DataFrame, sensors: Mapping[float, SensorRecord], label: str = "synthetic sensor"
) -> pd.DataFrame:
    """RMS and SD of simulation and sensor, g; printed differences (%) are the paper's, against its own measured data.

    Parameters
    ----------
    metrics : DataFrame
        Rows of ``measure.metrics.run_metrics``, one for each speed of ``sensors``.
    sensors : mapping
        Motor speed (rev/min) to its record.
    label : str
        What the sensor record is; stands in every row.
    """
    rows = []
    statistics = (("rms", rms, printed.RMS_DIFFERENCE), ("sd", standard_deviation, printed.SD_DIFFERENCE))
    for rpm, record in sorted(sensors.items()):
        run = _row_of(metrics, rpm)
        row = {"speed_rpm": rpm, "sensor_record": label}
        for name, statistic, paper in statistics:
            simulated, measured = float(run[f"{name}_g"]), statistic(record.ay_g)
            row |= {
                f"{name}_simulation_g": simulated,
                f"{name}_standard_error_g": float(run[f"{name}_error_g"]),
                f"{name}_sensor_g": measured,
                f"{name}_difference_pct": value_difference(simulated, measured),
                f"{name}_difference_printed_against_papers_own_data_pct": paper.value.get(rpm, float("nan")),
            }
        rows.append(row)
    return pd.DataFrame(rows)


def lines_table(
    metrics: pd.DataFrame, sensors: Mapping[float, SensorRecord], label: str = "synthetic sensor"
) -> pd.DataFrame:
    """Main lines of the spectra, two rows a speed: simulation and sensor, each beside its printed value.

    Parameters are those of :func:`table3`.
    """
    rows, lines = [], ("line_hz", "line_g", "line_binfree_hz", "line_binfree_g")
    for rpm, record in sorted(sensors.items()):
        run = _row_of(metrics, rpm)
        simulated = [float(run[name]) for name in ("line_hz", "line_g", "line_hz_binfree", "line_g_binfree")]
        signal = (record.ay_g, record.rate_hz)
        measured = [*main_line(*signal), *main_line_binfree(*signal)[:2]]
        for source, of_paper, line, paper_hz, paper_g in (
            ("simulation", "simulation", simulated, printed.SIMULATED_LINE_HZ, printed.SIMULATED_LINE_G),
            (label, "experiment", measured, printed.MEASURED_LINE_HZ, printed.MEASURED_LINE_G),
        ):
            row = {"speed_rpm": rpm, "source": source, **dict(zip(lines, line, strict=True))}
            row |= {"printed_of_papers": of_paper, "line_printed_hz": paper_hz.value.get(rpm, float("nan"))}
            rows.append(row | {"line_printed_g": paper_g.value.get(rpm, float("nan"))})
    return pd.DataFrame(rows)


def table4(metrics: pd.DataFrame, speeds: Iterable[float]) -> pd.DataFrame:
    """RMS and SD with three tooth surfaces beside the ten arcs: Table 4 without the lost comparison.

    ``metrics`` holds the runs ``115rpm`` and ``coarse/115rpm`` of every speed (rev/min).
    """
    rows = []
    table = metrics.set_index("run")
    for rpm in speeds:
        fine, coarse = table.loc[f"{rpm:g}rpm"], table.loc[f"coarse/{rpm:g}rpm"]
        row = {"rpm": rpm}
        for name in ("rms_g", "sd_g", "left_rms_n"):
            row[f"{name}_ten_arcs"] = fine[name]
            row[f"{name}_three_surfaces"] = coarse[name]
            row[f"{name}_difference_pct"] = 100 * (coarse[name] / fine[name] - 1) if fine[name] else float("nan")
        rows.append(row)
    return pd.DataFrame(rows)


def ladder_table(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a scene and setting of the ladder's long table, in its order."""
    key = ["scene", "setting"]
    columns = ["rms", "sd", "line", "left_share", "right_share", "ring_share", "left_peak"]
    wide = rows.pivot(index=key, columns="measure", values="difference_pct")[columns]
    gap = rows[rows["measure"] == "loop_gap"].set_index(key)["value"]
    cost = rows.groupby(key, sort=False)["wall_s_per_s"].first()
    return wide.join(gap.rename("loop_gap_m")).join(cost).loc[cost.index].reset_index()


def trade_summary(rows: pd.DataFrame, agreement: pd.DataFrame, promises: pd.DataFrame, scaling: pd.DataFrame) -> str:
    """What the study of cost and accuracy found, in a page of Markdown."""
    rows = rows.reset_index(drop=True)
    tried = rows.drop_duplicates(["scene", "fidelity", "integrator", "step_s"])
    kept = promises[promises["achieved_error"].notna()]
    met = int(kept["met"].astype(bool).sum())
    share = f" ({100 * met / len(kept):.1f} %)" if len(kept) else ""
    base = rows[(rows["fidelity"] == "ten_arcs") & (rows["integrator"] == "semi_implicit")]
    standard = base.loc[np.isclose(base["step_s"], 1e-4), "cpu_s_per_s"].median()
    method = rows["integrator"].str.split().str[0]
    costs = rows[rows["measure"].isin(["rms", "state_m"]) & (method != "adaptive")]
    cost = costs.groupby(["fidelity", method, "step_s"], sort=False)["cpu_s_per_s"].median().div(standard)
    return f"""\
{len(tried)} settings tried, {int(tried["failed"].astype(bool).sum())} of them refused or diverged.
Planner on scenes kept apart: {met} of {len(kept)} promises kept{share}; \
{len(promises) - len(kept)} tolerances were not promised.
Cost is CPU time per simulated second over that of the standard run (ten arcs, semi-implicit Euler, 1e-4 s).

{cost.rename("cost over standard").reset_index().to_markdown(index=False, floatfmt=".3g")}

Two references of different method differ by (relative, turns for shares, m):

{agreement.to_markdown(index=False, floatfmt=".2g") if len(agreement) else "not checked in the short form"}

Scaling: runs, processes, wall time, model:

{scaling.to_markdown(index=False, floatfmt=".3g")}
"""
