"""Tables of the report: what each holds, and writing it as CSV and Markdown."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from replication.paper import printed
from replication.paper.cells import value_difference
from replication.peers import OURS, PEER
from replication.studies import BY_NAME
from trackdyn.errors import InputError
from trackdyn.files import replacing
from trackdyn.measure.columns import error_of, groups, heading, words
from trackdyn.measure.sensor_metrics import own_metrics
from trackdyn.parameters.groove import Groove
from trackdyn.plots.cells import significant
from trackdyn.sensor.sensor_csv import SensorRecord

# columns of the Markdown tables; others are left out there
COLUMNS_OF = {
    "table3": (
        "speed_rpm",
        *(
            f"{name}_{what}"
            for name in ("rms", "sd")
            for what in (
                "simulation_g", "standard_error_g", "sensor_g", "sensor_error_g", "difference_pct",
                "difference_error_pct", "difference_printed_against_papers_own_data_pct",
            )
        ),
    ),
    "table4": (
        "rpm",
        *(
            f"{name}_{what}"
            for name in ("rms_g", "sd_g", "left_rms_n")
            for what in (
                "ten_arcs", "ten_arcs_error", "three_surfaces", "three_surfaces_error", "difference_pct",
                "difference_error_pct",
            )
        ),
    ),
    "lines": (
        "speed_rpm", "source",
        *(f"line_{kind}{what}" for what in ("hz", "error_hz", "g", "error_g") for kind in ("", "binfree_")),
        "line_printed_hz", "line_printed_g",
    ),
    "fidelity": (
        "scene", "setting", "rms", "sd", "line", "left_share", "right_share", "ring_share", "left_peak", "loop_gap_m",
        "wall_s_per_s",
    ),
    "limits": (
        "scene", "measure", "limit", "limit_error",
        # the presets by name: to ask `scene.fidelity` would make tables depend on the kernels
        *(f"{name}_{what}" for name in ("fast", "standard", "paper", "reference") for what in ("pct", "error_pct")),
        "standard_within_bound",
    ),
    "peer_answers": (
        "code", "method", "step_s", "rms_m_s2", "difference_pct", "uncertainty_pct", "scatter_pct", "cpu_s_per_s",
        "passages", "cpu_s", "chosen", "note",
    ),
    "costs": ("rule", "jobs", "wall_s", "cpu_s", "largest_memory_mb"),
}  # fmt: skip


def headed(frame: pd.DataFrame, key: str) -> pd.DataFrame:
    """A table with the columns of ``COLUMNS_OF`` and headings in words, a group above what is in it."""
    shown = frame[[column for column in COLUMNS_OF[key] if column in frame]]
    heads = []
    for group, count in groups(shown):
        for column in shown.columns[len(heads) : len(heads) + count]:
            name = heading(column.partition("_")[2] if group else column, change=key == "fidelity")
            heads.append(f"{words(group)}<br>{name}" if group else name)
    return shown.set_axis(heads, axis=1)


def _cell(column: str, value, digits: int) -> str:
    """A cell of a column: percent and points have no more than two decimals."""
    if re.search(r"pct$|\(%[^)]*\)$", column) and isinstance(value, float) and abs(value) < 10:
        return f"{value:.2f}".replace("-0.00", "0.00")
    return significant(value, digits)


def write_captioned_table(
    frame: pd.DataFrame, csv_path: Path | str, caption: str, digits: int = 3, shown: pd.DataFrame | None = None
) -> None:
    """Write a table as CSV in full precision, and beside it as Markdown with its caption, both without the index.

    The Markdown table has so many significant ``digits``; ``shown`` is another form of the table for it.
    """
    csv_path = Path(csv_path)
    csv_path.parent.mkdir(parents=True, exist_ok=True)
    shown = frame if shown is None else shown
    cells = shown.astype(object).apply(lambda column: [_cell(column.name, value, digits) for value in column])
    right = [kind.kind in "if" for kind in shown.dtypes]
    body = cells.to_markdown(index=False, disable_numparse=True, colalign=["right" if r else "left" for r in right])
    with replacing(csv_path) as csv, replacing(csv_path.with_suffix(".md")) as markdown:
        csv.write_text(frame.to_csv(index=False, lineterminator="\n"), encoding="utf-8", newline="")
        markdown.write_text(f"{caption}\n\n{body}\n", encoding="utf-8", newline="")


def cost_table(folder: Path | str) -> pd.DataFrame:
    """What every rule cost, from what each job wrote into a folder: ``rule, jobs, wall_s, cpu_s, largest_memory_mb``.

    Jobs of a kind share a row, the dearest stand first. Their total follows, and then what is asked for by name.
    """
    folder, rows = Path(folder), []
    for path in sorted(folder.rglob("*.tsv")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        row = pd.read_csv(path, sep="\t").iloc[-1]
        # one line for all runs of a kind: simulate/ring/..., simulate/meshing/..., simulate records
        kind = name.rpartition("/")[0]
        kind = name if kind in ("", "short") else kind  # short forms of the studies stand in a folder
        rows.append({"rule": kind, "wall_s": row["s"], "cpu_s": row["cpu_time"], "memory_mb": row["max_rss"]})
    if not rows:
        return pd.DataFrame(columns=["rule", "jobs", "wall_s", "cpu_s", "largest_memory_mb"])
    table = pd.DataFrame(rows).groupby("rule", as_index=False)
    sums = {"jobs": ("wall_s", "size"), "wall_s": ("wall_s", "sum"), "cpu_s": ("cpu_s", "sum")}
    table = table.agg(**sums, largest_memory_mb=("memory_mb", "max")).sort_values("wall_s", ascending=False)
    named = table["rule"].str.partition("/")[0].isin(BY_NAME)
    run, own = table[~named], table[named]
    total = run.agg({"jobs": "sum", "wall_s": "sum", "cpu_s": "sum", "largest_memory_mb": "max"})
    total = pd.DataFrame([{"rule": "all of a run"} | total.to_dict()]).astype({"jobs": int})
    return pd.concat([run, total, own.assign(rule=own["rule"] + ", by name")], ignore_index=True)


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


def table3(
    metrics: pd.DataFrame, sensors: Mapping[float, SensorRecord], label: str = "synthetic sensor"
) -> pd.DataFrame:
    """RMS and SD of simulation and sensor, g; printed differences (%) are the paper's, against its own measured data.

    ``metrics`` has a row for each speed (rev/min) of ``sensors``; ``label``, what the record is, stands in every row.
    """
    rows = []
    for rpm, record in sorted(sensors.items()):
        run = _row_of(metrics, rpm)
        sensor = own_metrics(record.ay_g, record.rate_hz, run["line_hz_binfree"])
        row = {"speed_rpm": rpm, "sensor_record": label}
        for name, paper in (("rms", printed.RMS_DIFFERENCE), ("sd", printed.SD_DIFFERENCE)):
            simulated, error = float(run[f"{name}_g"]), float(run[f"{name}_error_g"])
            measured, off = sensor[f"{name}_g"], sensor[f"{name}_error_g"]
            row |= {
                f"{name}_simulation_g": simulated, f"{name}_standard_error_g": error,
                f"{name}_sensor_g": measured, f"{name}_sensor_error_g": off,
                f"{name}_difference_pct": value_difference(simulated, measured),
                f"{name}_difference_error_pct": 100 * ratio_of_runs(simulated, error, measured, off)[1],
                f"{name}_difference_printed_against_papers_own_data_pct": paper.value.get(rpm, float("nan")),
            }  # fmt: skip
        rows.append(row)
    return pd.DataFrame(rows)


def ratio_of_runs(value: float, error: float, base: float, base_error: float) -> tuple[float, float]:
    """Ratio of two independent results and its standard error, to first order (JCGM 100:2008, 5.1.2); NaN over zero."""
    ratio = value / base if base else float("nan")
    return ratio, float(np.hypot(error, ratio * base_error) / abs(base)) if base else float("nan")


def lines_table(
    metrics: pd.DataFrame, sensors: Mapping[float, SensorRecord], label: str = "synthetic sensor"
) -> pd.DataFrame:
    """Dominant peaks of the spectra, two rows a speed: simulation and sensor, each beside its printed value.

    Parameters are those of :func:`table3`.
    """
    rows = []
    # as they are called here: as in `sensor_metrics`
    names = {name: name for name in ("line_hz", "line_error_hz", "line_g", "line_error_g")}
    names |= {f"line_binfree_{end}": f"line_{end}_binfree" for end in ("hz", "error_hz", "g", "error_g")}
    for rpm, record in sorted(sensors.items()):
        run = _row_of(metrics, rpm)
        measured = own_metrics(record.ay_g, record.rate_hz, run["line_hz_binfree"])
        for source, of_paper, line, paper_hz, paper_g in (
            ("simulation", "simulation", run, printed.SIMULATED_LINE_HZ, printed.SIMULATED_LINE_G),
            (label, "experiment", measured, printed.MEASURED_LINE_HZ, printed.MEASURED_LINE_G),
        ):
            row = {"speed_rpm": rpm, "source": source} | {name: float(line[column]) for name, column in names.items()}
            row |= {"printed_of_papers": of_paper, "line_printed_hz": paper_hz.value.get(rpm, float("nan"))}
            rows.append(row | {"line_printed_g": paper_g.value.get(rpm, float("nan"))})
    return pd.DataFrame(rows)


def table4(metrics: pd.DataFrame, speeds: Iterable[float]) -> pd.DataFrame:
    """RMS and SD with three tooth surfaces beside the ten arcs, each with its standard error: Table 4 without the lost
    comparison.

    ``metrics`` holds the runs ``115rpm`` and ``coarse/115rpm`` of every speed (rev/min).
    """
    rows = []
    table = metrics.set_index("run")
    for rpm in speeds:
        fine, coarse = table.loc[f"{rpm:g}rpm"], table.loc[f"coarse/{rpm:g}rpm"]
        row = {"rpm": rpm}
        for name in ("rms_g", "sd_g", "left_rms_n"):
            error = error_of(name)
            row |= {f"{name}_ten_arcs": fine[name], f"{name}_ten_arcs_error": fine[error]}
            row |= {f"{name}_three_surfaces": coarse[name], f"{name}_three_surfaces_error": coarse[error]}
            ratio, off = ratio_of_runs(coarse[name], coarse[error], fine[name], fine[error])
            row |= {f"{name}_difference_pct": 100 * (ratio - 1), f"{name}_difference_error_pct": 100 * off}
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


def trade_summary(rows: pd.DataFrame, agreement: pd.DataFrame, promises: pd.DataFrame) -> str:
    """What the study of cost and accuracy found, in a page of Markdown."""
    rows = rows.reset_index(drop=True)
    tried = rows.drop_duplicates(["scene", "fidelity", "integrator", "step_s"])
    kept = promises[promises["achieved_error"].notna()]
    met = int(kept["met"].astype(bool).sum())
    share = f" ({100 * met / len(kept):.1f} %)" if len(kept) else ""
    base = rows[(rows["fidelity"] == "ten_arcs") & (rows["integrator"] == "semi_implicit")]
    standard = base.loc[np.isclose(base["step_s"], 1e-4), "cpu_s_per_s"].median()
    costs = rows[(rows["measure"] == "rms") & (rows["fidelity"] != "belt")]
    cost = costs.groupby(["fidelity", "integrator", "step_s"], sort=False)["cpu_s_per_s"].median().div(standard)
    costs = cost.rename("cost over standard").reset_index()
    costs["cost over standard"] = [significant(value) if value == value else "refused or diverged" for value in cost]
    open_ones = promises[promises["achieved_error"].isna()]
    reasons = open_ones.groupby(["measure", "reason"]).size().rename("tolerances").reset_index()
    return f"""\
{len(tried)} settings tried, {int(tried["failed"].astype(bool).sum())} of them refused or diverged.
Planner on scenes kept apart: {met} of {len(kept)} promises kept{share}; \
{len(open_ones)} tolerances were not promised.
Cost is CPU time per simulated second over that of the standard run (ten arcs, semi-implicit Euler, 1e-4 s).

{costs.to_markdown(index=False, floatfmt=".3g")}

What was not promised, and why:

{reasons.to_markdown(index=False) if len(reasons) else "nothing"}

Two methods differ by (relative, turns for shares, m), with the standard error of the difference:

{agreement.to_markdown(index=False, floatfmt=".2g") if len(agreement) else "not checked in the short form"}
"""


def cost_ratio(table: pd.DataFrame) -> float:
    """CPU time of the other code over ours, both with the chosen step; not a number where it did not run."""
    chosen = table[table["chosen"] == "yes"].set_index("code")["cpu_s_per_s"]
    return float(chosen[PEER] / chosen[OURS]) if PEER in chosen else float("nan")


def table2_outcome(costs: pd.DataFrame, missing: str, accuracy_pct: float) -> str:
    """What came out, in a sentence below the caption of Table 2."""
    if missing:
        return f"Exudyn: {missing}."
    return f"At an error below {accuracy_pct:g} % Exudyn takes {cost_ratio(costs):.3g} times the CPU time."


def answers_outcome(table: pd.DataFrame, tolerance: float) -> str:
    """What came out, in a sentence below the caption."""
    chosen = table[table["chosen"] == "yes"].set_index("code")["cpu_s"]
    parts = [f"{code} takes {seconds:.3g} s of CPU time" for code, seconds in chosen.items()]
    missing = [code for code in table["code"].unique() if code not in chosen]
    parts += [f"{code} does not reach it with these settings or was not run" for code in missing]
    text = f"At an error of at most {100 * tolerance:g} %: {'; '.join(parts)}."
    if {"rms_m_s2", "difference_pct"} <= set(table):
        limits = (table["rms_m_s2"] / (1 + table["difference_pct"] / 100)).groupby(table["code"]).mean()
        if np.isfinite(limits.get(PEER, np.nan)):
            share = 100 * (limits[PEER] / limits[OURS] - 1)
            text += f" The RMS of {PEER} in the limit is {share:+.2g} % from ours."
    return text
