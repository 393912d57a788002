"""What a reader sees of the figures: text in a column of 84 mm, colours without colour, no label on a mark."""

from functools import cache
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from colorspacious import cspace_convert, deltaE
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from test_report import FIGURES, RUN, study

from replication.paper.contents import PAPER
from replication.report.figures.extremes import long_run_figure, solvers_figure, stability_figure
from replication.report.figures.meshing import passage_figure, printed_and_measured_times
from replication.report.figures.ring_study import duration_figure, force_figure
from replication.report.figures.trade import answer_figure, drawn_errors, planner_figure, work_precision
from replication.study.accuracy.trade import COLUMNS
from trackdyn.plots.style import COLOURS, WIDTH

COLUMN = 84 / 25.4  # inch
# as high an x as 5 points of Helvetica, the least that journals take: 0.547 against 0.523 em
LEAST_POINTS = 4.78
# CAM02-UCS; about 1 is just seen between large fields, thin lines need much more. Set when
# the palette was known: its least is 15.9, that of the one before 3.
LEAST_DIFFERENCE = 15.0
SIGHTS = ("grey", "protanomaly", "deuteranomaly", "tritanomaly")


def seen(colour, sight):
    """sRGB of a colour in grey, or to a reader who lacks a kind of cones."""
    if sight == "grey":
        lightness = cspace_convert(to_rgb(colour), "sRGB1", "CIELab")[0]
        return cspace_convert([float(lightness), 0.0, 0.0], "CIELab", "sRGB1")
    space = {"name": "sRGB1+CVD", "cvd_type": sight, "severity": 100}
    return np.clip(cspace_convert(to_rgb(colour), space, "sRGB1"), 0, 1)


def apart(one, two):
    """Least difference of two colours to any sight."""
    return min(deltaE(seen(one, sight), seen(two, sight), input_space="sRGB1") for sight in SIGHTS)


KEY = ("scene", "fidelity", "integrator")


def trade(errors=(1e-3, 2e-4, 1e-1, 0.0)):
    kinds = (
        ("ten_arcs", "semi_implicit"),
        ("ten_arcs", "rk4"),
        ("single_pin", "adaptive"),
        ("ten_arcs", "linearly_implicit"),
    )
    rows = [
        dict(zip(KEY, (scene, *kind), strict=True))
        | {"step_s": 1e-4, "cpu_s_per_s": 0.05 * 2**i, "measure": "left_share", "error": error, "failed": False}
        for scene in ("ring 0.308 m 115 rpm", "no ring 115 rpm", "ring 0.304 m 150 rpm")
        for i, (kind, error) in enumerate(zip(kinds, errors, strict=True))
    ]
    rows.append(
        dict(zip(KEY, ("no ring 115 rpm", "ten_arcs", "rk4"), strict=True))
        | {"step_s": 5e-4, "measure": "all", "failed": True}
    )
    return pd.DataFrame(rows, columns=COLUMNS)


def answers():
    """Peaks that scatter, and some that do not."""
    table = trade(errors=(1e-2, 2e-3, 1e-1, 1e-5))
    spent = {"measure": "left_peak", "start_cpu_s": 0.3, "passage_s": 0.2, "unused": 15, "uncertainty": 1e-4}
    scatter = np.resize([0.02, 0.02, 0.05, 1e-7], len(table))
    return table.assign(**spent, scatter=scatter).replace("adaptive", "semi_implicit")


def promises():
    rows = [
        {"measure": measure, "tolerance": tolerance, "achieved_error": 0.3 * tolerance / (k + 1), "met": True}
        for tolerance in (0.005, 0.01, 0.02)
        for k, measure in enumerate(("rms", "sd", "line", "left_peak", "left_share", "ring_share", "right_share"))
    ]
    rows[4] |= {"achieved_error": 0.0093, "met": False}
    return pd.DataFrame(rows)


def chains():
    rows = []
    for kind in ("link and connector", "uniform bars", "centres of percussion"):
        for solver in ("riccati", "multipliers", "transfer_product"):
            for at in (6, 12, 36, 70, 200, 10000):
                if solver == "transfer_product" and at > 36:
                    continue
                value = 1e-15 if solver != "transfer_product" else 1e-12 * 10 ** (0.3 * at)
                rows.append({
                    "family": "length of the chain", "group": f"{solver}, {kind}", "at": at, "value": value,
                    "expected": value if solver == "transfer_product" else None,
                    "measure": "residual" if at > 70 else "error", "outcome": "completed", "bound": None,
                })  # fmt: skip
    for modulus in (1e9, 2e11):
        for step, value in ((1e-5, 0.0), (1e-4, 5.0), (1e-3, np.nan)):
            rows.append({"family": "step and stiffness", "group": str(modulus), "at": step, "value": value,
                         "expected": 1e-4, "measure": "energy", "outcome": "refused", "bound": 1.0})  # fmt: skip
    return pd.DataFrame(rows)


CHUNKS = pd.DataFrame({"time_s": [10.0, 20.0], "loop_gap_max_m": 1e-13, "energy_residual": -1e-4, "rms_g": 1.1,
                       "resident_mb": 280.0})  # fmt: skip
DRAW = FIGURES | {
    "passage": lambda: passage_figure(RUN),
    "force": lambda: force_figure(study(), "rms"),
    "duration": lambda: duration_figure(study(error=2.0)),
    "trade": lambda: work_precision(trade(), "left_share"),
    "planner": lambda: planner_figure(promises()),
    "answers": lambda: answer_figure(answers(), "left_peak"),
    "solvers": lambda: solvers_figure(chains(), CHUNKS),
    "stable steps": lambda: stability_figure(chains(), CHUNKS),
    "long run": lambda: long_run_figure(chains(), CHUNKS),
}


@cache
def drawn(name):
    """A figure with everything in its place."""
    figure = DRAW[name]()
    figure.canvas.draw()
    return figure


def shown_texts(figure):
    """Texts that are to be seen, with their boxes in pixels."""
    renderer, hidden = figure.canvas.get_renderer(), []
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):  # beyond the view they are not drawn
            hidden += [] if low <= tick.get_loc() <= high else [tick.label1, tick.label2]
    return [
        (text, Text.get_window_extent(text, renderer))
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text not in hidden
    ]


def points_of(ax):
    """Marks of an axes within its frame, in pixels."""
    frame = ax.get_window_extent()
    lines = [
        line
        for line in ax.lines
        if line.get_marker() not in ("", "None", None) and line.get_transform() == ax.transData
    ]
    for line in lines:
        for x, y in ax.transData.transform(np.asarray(line.get_xydata(), dtype=float).reshape(-1, 2)):
            if np.isfinite([x, y]).all() and frame.contains(x, y):
                yield x, y


@pytest.mark.parametrize("name", DRAW)
def test_text_is_legible_in_a_column_and_within_the_figure(name):
    figure = drawn(name)
    assert figure.get_figwidth() == WIDTH
    width, height = figure.canvas.get_width_height()
    for text, box in shown_texts(figure):
        assert text.get_fontsize() * COLUMN / WIDTH >= LEAST_POINTS, text
        assert max(-box.x0, -box.y0, box.x1 - width, box.y1 - height) < 2, text


@pytest.mark.parametrize("name", DRAW)
def test_colours_of_a_figure_differ_to_every_sight(name):
    handles = [
        line for legend in drawn(name).findobj(Legend) for line in legend.legend_handles if isinstance(line, Line2D)
    ]
    looks = {(line.get_color(), line.get_linestyle(), line.get_marker()) for line in handles}
    for one, two in combinations(looks, 2):
        grey = any(len(set(to_rgba(look[0])[:3])) == 1 and look[0] != COLOURS[0] for look in (one, two))
        # a thin grey line is told by its dashes or marks
        assert one[0] == two[0] or apart(one[0], two[0]) >= LEAST_DIFFERENCE or (grey and one[1:] != two[1:]), (
            one,
            two,
        )


def test_the_palette_differs_and_the_test_would_see_one_that_does_not():
    assert min(apart(one, two) for one, two in combinations(COLOURS, 2)) >= LEAST_DIFFERENCE
    assert apart("#009E73", "#D55E00") < LEAST_DIFFERENCE  # one grey
    assert apart("#00a000", "#c07000") < LEAST_DIFFERENCE  # one colour to a reader without the second kind of cones


@pytest.mark.parametrize("name", DRAW)
def test_no_label_covers_a_mark_or_another_label(name):
    figure = drawn(name)
    boxes = shown_texts(figure)
    for (one, a), (two, b) in combinations(boxes, 2):
        across, up = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(across, up) < 4, f"{one.get_text()!r} and {two.get_text()!r}"
    legends = [legend.get_window_extent() for legend in figure.findobj(Legend)]
    for ax in figure.axes:
        frame, marks = ax.get_window_extent(), list(points_of(ax))
        written = [box for text, box in boxes if text in ax.texts]
        for box in written + [box for box in legends if frame.overlaps(box)]:
            assert not [mark for mark in marks if box.contains(*mark)]


def test_events_of_a_passage_stand_beside_the_printed_ones():
    times = printed_and_measured_times(RUN)
    assert times.loc["first contact of the left arc", ["printed", "here"]].tolist() == pytest.approx(
        [0.0, 0.098], abs=2e-3
    )
    assert times.loc["right maximum"].tolist() == pytest.approx([1.07, 0.083, 0.0002], abs=3e-3)
    assert np.isnan(times.loc["about to engage", "here"])
    events = drawn("passage").axes[2]
    assert [label.get_text() for label in events.get_yticklabels()][2:5] == [
        "first contact, left arc", "left maximum", "right maximum",
    ]  # fmt: skip
    assert any(text.get_text().startswith("1.07 / 0.08") for text in events.texts)
    found = [line.get_xdata()[0] for line in events.lines if len(line.get_xdata()) == 1 and line.get_ydata()[0] == 4]
    assert sorted(found) == pytest.approx(sorted(times.loc["right maximum"]))


def test_the_arrow_of_a_spike_stands_where_it_was():
    (arrow,) = [text for text in drawn("passage").axes[0].texts if text.arrow_patch is not None]
    assert arrow.xy[0] == arrow.xyann[0] == pytest.approx(0.0002, abs=1e-6)


def test_a_broken_promise_is_named_and_not_hidden():
    (ax,) = drawn("planner").axes
    assert "20 of 21 tolerances met" in ax.get_title("left")
    assert [text.get_text() for text in ax.texts] == ["missed: left share\n0.0093 at 0.005"]


def test_errors_next_to_nothing_do_not_stretch_the_axis():
    errors = pd.Series([1e-3, 2e-3, 4e-3, 0.0, 1e-12] + [1e-3] * 40)
    shown, floor = drawn_errors(errors)
    assert 1e-5 < floor < 1e-3 and shown.min() == floor
    assert (shown[errors > 1e-4] == errors[errors > 1e-4]).all()
    assert any(text.get_text().startswith("below") for text in drawn("trade").legends[0].get_texts())


def test_printed_radii_and_lines_are_marked():
    for name in ("force", "duration"):
        for ax in drawn(name).axes:
            assert {0.305, 0.308} <= {line.get_xdata()[0] for line in ax.lines if len(set(line.get_xdata())) == 1}
    main = drawn("spectrum").axes[0]
    printed = {tuple(line.get_xydata()[0]) for line in main.lines if str(line.get_label()).startswith("printed")}
    assert printed == {(0.233, 1.162), (0.253, 0.7698)}


def test_every_item_of_the_paper_that_is_drawn_from_runs_is_looked_at_here():
    modules = {item.draw.partition(":")[0].rpartition(".")[2] for item in PAPER if not item.table}
    schematic = {"system", "chain_piece", "topology", "locations", "groove", "engagement", "contact_cases", "flow"}
    # the independent code's figures have tests of their own, screenshots are pictures
    assert modules - schematic - {"peer", "screenshots"} == {"closure", "histories", "spectra", "meshing", "ring_study"}
