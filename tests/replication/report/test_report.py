"""Figures and tables from small made-up recordings: files, bytes, labels, numbers."""

from pathlib import Path
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tests.conftest import made_recording
from trackdyn.fieldtest.figures import history_figure, spectrum_figure
from trackdyn.fieldtest.sensor_csv import SensorRecord
from trackdyn.measure.estimators import sensor_metrics
from trackdyn.measure.events import mean_events
from trackdyn.measure.spectra import rms
from trackdyn.measure.uncertainty import batch_error
from trackdyn.plots.drawing import chain_points
from trackdyn.plots.ring_study import figures, quiet_from
from trackdyn.plots.style import new_figure, save
from trackdyn.rig.layout import assemble
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settling import Layout
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.paper.contents import PAPER
from trackdyn_replication.paper.evidence import Evidence
from trackdyn_replication.paper.measures import MAXIMUM, MEASURES
from trackdyn_replication.paper.published import SENSORS
from trackdyn_replication.report.figures import meshing
from trackdyn_replication.report.figures.records import closure_figure
from trackdyn_replication.report.figures.ring_study import MARKS, STEADY, creep_figure
from trackdyn_replication.report.figures.schematics import FIGURES
from trackdyn_replication.report.tables import lines_table, table1, table3

pytestmark = pytest.mark.slow

RIG = load_rig(Path(__file__).parents[3] / "trackdyn" / "rigs" / "paper.yaml")
RATE = 1000
RPM = 210.0
LOOP_HZ = RPM / 5.57 / 60 * 13 / 35
ASSEMBLY = assemble(RIG)
FRAME = np.concatenate([ASSEMBLY.pins[0], ASSEMBLY.angle, [ASSEMBLY.sprocket_angle]])


def wave(hz, seconds=20.0, amplitude=1.2, phase=0.3, seed=1):
    time = np.arange(round(seconds * RATE)) / RATE
    noise = 0.05 * np.random.default_rng(seed).standard_normal(len(time))
    return time, amplitude * np.cos(2 * np.pi * hz * time + phase) + noise


def recording(rpm=RPM, seconds=20.0):
    time, ay = wave(LOOP_HZ * rpm / RPM, seconds)
    s = len(time)
    # a level link: Eq. 40 adds 1 g
    mean = np.column_stack([np.zeros(s), (ay - 1) * RIG.gravity, np.zeros(s)])[:, None]
    gap, rate = 1e-13 * (1.5 + np.sin(time)) * (time > 0.01), np.full((s, 3), -2 * np.pi * rpm / 5.57 / 60)
    made = {"raw": mean, "mean": mean, "gap": gap, "wheel_rate": rate, "frame": FRAME[None]}
    made |= {"frame_time": np.zeros(1), "layout": Layout(ASSEMBLY.shift)}
    return made_recording(Scene(RIG, rpm, 0.308), time, np.zeros((s, 1, 3)), 6.0, **made)


def sensor(hz=1.05 * LOOP_HZ, amplitude=0.9):
    time, ay = wave(hz, amplitude=amplitude, phase=-2.0, seed=2)
    zero = np.zeros_like(time)
    return SensorRecord(Path("sensor.csv"), time, zero, ay, zero, float(RATE), 0)


def texts(figure: Figure) -> str:
    figure.canvas.draw()
    return "\n".join(text.get_text() for text in figure.findobj(mpl.text.Text))


@pytest.mark.parametrize("draw", [
    lambda: closure_figure({115: recording(rpm=115.0), 210: recording()}),
    lambda: history_figure(recording(), sensor(), "(d) 210 rpm"),
    lambda: spectrum_figure(recording(), sensor(), "(d) 210 rpm"),
], ids=["closure", "history", "spectrum"])  # fmt: skip
def test_the_same_data_give_the_same_bytes_whatever_the_user_prefers(draw, tmp_path):
    save(draw(), tmp_path / "first.png")
    with mpl.rc_context({"font.size": 20, "axes.grid": False, "svg.hashsalt": "other"}):
        save(draw(), tmp_path / "second.png")
    for kind in ("png", "svg"):
        first, second = ((tmp_path / f"{stem}.{kind}").read_bytes() for stem in ("first", "second"))
        assert first == second and len(first) > 5000
    assert len(list(tmp_path.iterdir())) == 4 and b"<dc:date>" not in first


def test_a_figure_that_cannot_be_drawn_leaves_no_file(tmp_path):
    figure = new_figure(2.0)
    figure.subplots().set_title(r"$\notacommand$")
    with pytest.raises(ValueError):
        save(figure, tmp_path / "broken.png")
    assert list(tmp_path.iterdir()) == []


def test_picket_fence_of_the_printed_record_at_115_rpm():
    shown = texts(spectrum_figure(recording(115.0, seconds=90.0), sensor(0.13)))
    assert "bin 11.50" in shown and "64 %" in shown


def test_without_a_sensor_record_the_simulation_stands_alone_and_says_so():
    for draw in (history_figure, spectrum_figure):
        assert "simulation; no sensor record" in texts(draw(recording(), None, "(d) 210 rpm", SENSORS[None]))
    table = table3(metrics(), {210.0: None}, SENSORS[None]).iloc[0]
    assert table["sensor_record"] == "no sensor record" and table["rms_simulation_g"] > 0
    assert np.isnan(table["rms_sensor_g"]) and np.isnan(table["rms_difference_pct"])
    assert list(lines_table(metrics(), {210.0: None}, SENSORS[None])["source"]) == ["simulation"]
    captions = {item.key: item.caption(None) for item in PAPER}
    assert "There is no sensor record" in captions["fig17"][-1] and "no sensor" not in " ".join(captions["fig01"])


def test_chain_points_follow_the_bodies_and_close():
    pins, angles, sprocket_angle = chain_points(RIG, FRAME)
    assert pins.shape == (71, 2) and len(angles) == 70 and sprocket_angle == ASSEMBLY.sprocket_angle
    np.testing.assert_allclose(pins, [*ASSEMBLY.pins, pins[0]], atol=1e-9)
    lengths = np.hypot(*np.diff(pins, axis=0).T).reshape(-1, 2)
    np.testing.assert_allclose(lengths, np.tile([RIG.chain.link_length, RIG.connector_length], (35, 1)))


def test_table1_has_the_areas_of_the_groove():
    table = table1(RIG.groove_profile)
    assert list(table["area"]) == list(range(1, 11))
    assert list(table.loc[table["type"] == "convex", "area"]) == [1, 4, 7, 10]
    assert table.loc[1, "r_mm"] == pytest.approx(1000 * RIG.groove.r2)
    assert 0 < table["theta_deg"].min() < table["theta_deg"].max() < 90
    assert table["length_mm"].min() > 1  # none of the ten arcs of the default rig is one only in name


def test_claim_table_and_figures_have_one_reading_of_a_maximum_and_name_it():
    """The judged time of a maximum is that of the table of events, of Figure 19 and of the panel of Figure 20."""
    scene = Scene(RIG, 115.0, None, duration=18.0, lead_in=1.0, frame_interval=0.01, pitches=(1, 2))
    without_ring = simulate(scene)  # two passages
    events = mean_events(without_ring).assign(run="meshing/no_ring")
    evidence = Evidence(pd.DataFrame(), events, RIG, 115.0)
    selected = meshing.select_passage(without_ring)
    drawn = {moment.title: moment.time for moment in meshing.moments(without_ring, selected)}
    table = meshing.printed_and_measured_times(without_ring)
    for side in ("left", "right"):
        judged = MEASURES[f"{side}_maximum_without_ring"].evaluate(evidence, [115.0])
        scatter = events.set_index("event").at[f"{side} {MAXIMUM}", "sd_s"]
        assert judged == [table.at[f"{side} maximum", "here"]]
        # one passage of those whose median is judged; samples are 1 ms apart
        assert drawn[f"{side} maximum"] == pytest.approx(judged[0], abs=2 * np.nan_to_num(scatter) + 0.0015)
    assert list(drawn)[2:4] == ["left maximum", "right maximum"]  # the order of the paper
    figure = meshing.passage_figure(without_ring)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    marks = [line for line in figure.axes[0].lines if line.get_marker() in ("o", "s", "^")]
    assert ("largest of all time steps" in labels) == bool(marks)


def metrics(**changes):
    row = {
        "run": "210rpm", "rpm": RPM, "rms_g": 1.1, "sd_g": 0.5, "rms_error_g": 0.01, "sd_error_g": 0.02,
        "line_hz": 0.25, "line_g": 1.15, "line_hz_binfree": LOOP_HZ, "line_g_binfree": 1.2, "line_error_hz": 0.003,
        "line_error_g": 0.02, "line_error_hz_binfree": 1e-5, "line_error_g_binfree": 0.03,
    }  # fmt: skip
    return pd.DataFrame([row | changes])


def test_table3_takes_the_value_difference_of_the_paper():
    # ten turns of a loop whose mean is 1 and whose SD is 1, by turns 0.02 more and less
    time = np.arange(20000) / 1000
    swing = 1 + 0.02 * np.tile(np.repeat([1.0, -1.0], 2000), 5)
    record = SimpleNamespace(ay=1 + 2**0.5 * swing * np.cos(np.pi * time), rate=1000.0)
    row = table3(metrics(rms_g=1.1 * 2**0.5, sd_g=0.75), {RPM: record}).iloc[0]
    assert row["rms_sensor_g"] == pytest.approx(2**0.5, rel=1e-3)
    assert row[["rms_difference_pct", "sd_difference_pct"]].tolist() == pytest.approx([10.0, 25.0], abs=0.1)
    # that of the mean of ten values of 1 +- 0.02; the fitted turn is a few samples off
    error = batch_error(swing[::2000])[0]
    assert row["sd_sensor_error_g"] == pytest.approx(error, rel=0.1)
    assert row["sd_difference_error_pct"] == pytest.approx(100 * np.hypot(0.02, 0.75 * error), rel=0.1)
    printed = [row[f"{name}_difference_printed_against_papers_own_data_pct"] for name in ("rms", "sd")]
    assert printed == [7.02, 8.05] and row["sd_standard_error_g"] == 0.02
    assert row["sensor_record"] == "synthetic sensor"
    none = table3(metrics(rpm=100.0), {100.0: sensor()}).iloc[0]
    assert np.isnan(none["rms_difference_printed_against_papers_own_data_pct"])


def test_table3_takes_whole_turns_of_the_loop_as_compare_does():
    """A record of two and a half turns is worth two, in the simulation as in the record."""
    time = np.arange(round(2.5 / LOOP_HZ * RATE)) / RATE
    ay = 1 + 0.5 * np.sin(2 * np.pi * LOOP_HZ * time)
    record = SimpleNamespace(ay=ay, rate=float(RATE))
    both = sensor_metrics(ay, RATE, LOOP_HZ)
    row = table3(metrics(**{name: both[name] for name in metrics() if name in both}), {RPM: record}).iloc[0]
    assert row["rms_simulation_g"] == pytest.approx((1 + 0.125) ** 0.5, rel=1e-4)
    assert abs(row["rms_difference_pct"]) < 1e-2 and abs(rms(ay) / row["rms_simulation_g"] - 1) > 0.01


def study(right=(5.0, 1.0, 0.0, 0.0)):
    """Shares, forces and errors by radius, those of the right arc at 210 rpm as stated."""
    table = pd.DataFrame({"rpm": np.repeat([115.0, 210.0], 4), "ring_radius_m": [0.303, 0.304, 0.305, 0.306] * 2})
    for side, values in (("left", 9.0), ("right", [0.0] * 4 + [*right]), ("ring", 50.0)):
        table = table.assign(**{f"{side}_{name}": values for name in ("share_pct", "rms_n", "sd_n")})
        table = table.assign(**{f"{side}_{name}": 0.01 for name in ("share_error_pct", "rms_error_n", "sd_error_n")})
    return table


def test_where_contact_ends_is_computed():
    assert quiet_from(study(), "right_share_pct") == 0.305
    assert quiet_from(study(right=(5.0, 0.0, 1.0, 0.0)), "right_share_pct") == 0.306
    assert quiet_from(study(), "left_share_pct") is None
    assert "right arc: none from 0.305 m on" in texts(figures(study(), MARKS)["fig23_a"])
    assert ": none from" not in texts(figures(study(right=(1.0, 1.0, 1.0, 1.0)), MARKS, STEADY)["fig24"])


def test_durations_of_both_rigs_are_within_their_axes():
    figure = creep_figure(study(), study().assign(left_share_pct=40.0))
    for ax in figure.axes:
        low, high = ax.get_ylim()
        assert all(low < value < high for curve in ax.lines[:2] for value in curve.get_ydata())


@pytest.mark.parametrize("name", ["bench", "robot", "m113"])
def test_schematics_of_rigs_with_other_wheels_are_drawn(name):
    """One wheel, two on arms, six besides the sprocket, without a ring."""
    for draw in FIGURES.values():
        assert draw(load_rig(name)).axes
