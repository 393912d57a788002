"""Extremes: outcomes of all cases, and curves of the families that measure a quantity."""

from trackdyn.sweeps.snakemake_job import run_job

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from trackdyn.inputs.files import write_csv
from trackdyn.plots.style import BLACK, BLUE, ORANGE, VERMILION, new_figure, save, styled
from trackdyn_replication.study.extremes.judge import COLUMNS, extremes_summary
from trackdyn_replication.study.extremes.long_run import long_run
from trackdyn_replication.study.extremes.resolved import short_runs_summary
from trackdyn_replication.study.extremes.stability_map import QUANTITIES, map_rows, stable_steps
from trackdyn_replication.study.settings import LONG_RUN, ExtremesStudy, parts_of

SOLVERS = {"riccati": (BLUE, "Riccati"), "transfer_product": (VERMILION, "transfer product")}
KIND_LOOKS = {"link and connector": ("-", "o"), "uniform bars": ("--", "s"), "centres of percussion": (":", "^")}
ALL_LOST = 1e6  # above this every digit is lost: points beyond say no more


@styled
def solvers_figure(rows: pd.DataFrame) -> Figure:
    """Draw the error of the transfer product (a) and the residual of the Riccati form (b) over the number of bodies."""
    table = rows[(rows["family"] == "length of the chain") & (rows["group"] != "")]
    figure = new_figure(5.0)
    errors, residuals = figure.subplots(2, 1, height_ratios=(2.0, 1.0))
    for group, group_rows in table.groupby("group", sort=False):
        solver, kind = group.split(", ")
        (dashes, marker), (colour, name) = KIND_LOOKS[kind], SOLVERS[solver]
        group_rows = group_rows.astype({"at": float, "value": float, "expected": float}).sort_values("at")
        measured = group_rows[np.isfinite(group_rows["value"]) & (group_rows["value"] < ALL_LOST)]
        # measured points of the product stand by their prediction; the sweep has none
        look = {"color": colour, "linestyle": "none" if solver == "transfer_product" else dashes}
        for ax, here in ((errors, measured["measure"] != "residual"), (residuals, measured["measure"] == "residual")):
            label = f"{name}, {kind}" if here.any() else None
            ax.plot(measured["at"][here], measured["value"][here], **look, marker=marker, label=label)
        predicted = group_rows[group_rows["expected"].notna() & (group_rows["expected"] < ALL_LOST)]
        if len(predicted) > 1:
            look = {"color": BLACK, "linestyle": dashes, "linewidth": 1.2}
            errors.plot(predicted["at"], predicted["expected"], **look, label=f"predicted growth, {kind}")
    longest = table.loc[table["measure"] != "residual", "at"].astype(float).max()
    errors.set(
        xscale="log", yscale="log", ylabel="relative difference", xlim=(5, 1.2 * longest), ylim=(3e-17, ALL_LOST)
    )
    errors.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    errors.xaxis.set_major_formatter("{x:g}")
    errors.xaxis.set_minor_formatter(NullFormatter())
    residuals.set(xscale="log", yscale="log", xlabel="bodies of the chain", ylabel="relative residual")
    errors.set_title("(a) transfer product: difference from (b), median of three poses")
    residuals.set_title("(b) Riccati form: residual of the equations of motion")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled
def stability_figure(rows: pd.DataFrame) -> Figure:
    """Draw forced runs over step and one quantity per panel, with the step limit predicted beforehand."""
    kinds = [name for name in QUANTITIES if (rows["family"] == f"step and {name}").any()]
    limits, high = stable_steps(rows), (len(kinds) + 1) // 2
    figure = new_figure(2.2 * high)
    panels = figure.subplots(high, 2, squeeze=False).ravel()
    for ax, name in zip(panels, kinds, strict=False):
        table = map_rows(rows, name)
        stable, bounded = table["value"] <= table["bound"], np.isfinite(table["value"])
        for mask, look, label in (
            (stable, {"marker": "o", "color": BLUE}, "stable"),
            (~stable & bounded, {"marker": "D", "color": ORANGE}, "gains energy"),
            (~stable & ~bounded, {"marker": "x", "color": VERMILION}, "left the physical range"),
        ):
            if mask.any():
                ax.scatter(table["group"][mask], table["at"][mask], s=14, label=label, **look)
        limit = limits[limits["quantity"] == name]
        ax.plot(limit["value"], limit["limit"], color=BLACK, marker="_", label="predicted limit")
        ax.plot(limit["value"], limit["stable"], color=BLUE, linestyle=":", label="largest stable step")
        ax.set(xscale="linear" if name == "ring" else "log", yscale="log", ylabel="step (s)", xlabel=QUANTITIES[name])
        if table["group"].max() < 100 * table["group"].min() and name != "ring":  # powers of ten would be one tick
            ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter(NullFormatter())
    for ax in panels[len(kinds) :]:
        ax.set_axis_off()
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


WORDS = dict.fromkeys(("family", "case", "outcome", "reason", "measure", "group"), str)


@run_job
def main(job) -> None:
    """Rule `extremes`."""
    study, out = ExtremesStudy(**job.params.study), job.output
    # words stay words, and one that is not there is empty
    read = [pd.read_csv(path, dtype=WORDS).fillna(dict.fromkeys(WORDS, "")) for path in job.input.parts]
    tables = dict(zip(parts_of(study), read, strict=True))
    write_csv(out.chunks, chunks := tables.pop(LONG_RUN))
    rows = pd.concat([pd.DataFrame(long_run(chunks), columns=COLUMNS), *tables.values()], ignore_index=True)
    write_csv(out.csv, rows)
    write_csv(out.summary, extremes_summary(rows))
    write_csv(out.short_runs, short_runs_summary(rows))
    save(solvers_figure(rows), out.solvers[0])
    save(stability_figure(rows), out.stability[0])
