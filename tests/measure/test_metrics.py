"""The row of a run and its table: records that begin and end anywhere, whole errors, remarks, a picture."""

import inspect
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

import trackdyn
from tests.conftest import BELT, refused
from trackdyn.measure import catalogue
from trackdyn.measure.catalogue import CATALOGUE
from trackdyn.measure.columns import METRIC_COLUMNS, described
from trackdyn.measure.estimators import sensor_metrics
from trackdyn.measure.metrics import remarks, run_metrics, shown_measures, total_errors, unknown_step_errors
from trackdyn.measure.spectra import rms
from trackdyn.measure.uncertainty import STEP_ERRORS, batch_degrees
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording


@pytest.fixture(scope="module")
def run(rig):
    return trackdyn.simulate(trackdyn.Scene(rig, 115.0, duration=0.5))


def test_a_tolerance_is_asked_of_measures_that_every_link_gives_alone():
    """Not of one of a sensor's record with a name, but no series; those of today stay."""
    added = 'CATALOGUE = (_entry("crest", "1", "peak over RMS", lambda s: s.of(max), Studied("crest", "crest")), '
    source = inspect.getsource(catalogue).replace("CATALOGUE = (", added)
    exec(compile(source, "catalogue", "exec"), names := {"__name__": "catalogue"})
    assert "crest" in names["NAMED"] and "crest" in names["RELATIVE"]
    assert (names["TOLERATED"], names["SENSED"]) == (catalogue.TOLERATED, catalogue.SENSED)
    assert catalogue.SENSED == ("rms", "sd", "line", "high_frequency")


def test_the_table_has_the_values_errors_and_units_of_the_metrics(run):
    table, row = trackdyn.measures(run), run_metrics("", run)
    assert list(table.columns) == ["value", "error", "half_width", "unit", "measure"] and table.index.name == "name"
    assert {"rms_g", "sd_g", "passages", "clipped_samples"} <= set(table.index)
    assert table["value"].to_dict() == {name: row[name] for name in table.index} and table["value"].notna().all()
    assert table.loc["rms_g", "unit"] == "g" and table["error"].dtype == float and all(table["measure"].str.len() > 5)
    header, _, *printed = str(table).splitlines()
    assert header.split() == list(table.columns) and "..." not in str(table) and len(printed) == len(table)
    assert f"{row['rms_g']:.5g}" in str(table)


def test_statistics_of_whole_revolutions_do_not_depend_on_what_is_left_over():
    """Two sines and a half: its RMS is 1/sqrt(2) over whole periods, its mean zero."""
    a = np.sin(2 * np.pi * 0.1 * np.arange(25_000) / 1000) + 1.0
    row = sensor_metrics(a, 1000.0, 0.1)
    assert (row["rms_g"], row["sd_g"]) == pytest.approx((1.5**0.5, 0.5**0.5), abs=1e-6)
    assert abs(rms(a) - 1.5**0.5) > 0.01


def test_the_cut_is_measured_where_it_was_recorded(run):
    for cut, expected in ((np.zeros((0, 2)), (np.nan, np.nan)), (np.array([[1e-9, 2e-5], [3e-9, 1e-5]]), (3e-9, 2e-5))):
        row = run_metrics("some", replace(run, cut=cut))
        np.testing.assert_equal((row["gap_before_projection_m"], row["velocity_gap_m_s"]), expected)
        assert row.keys() <= METRIC_COLUMNS.keys()


def test_the_step_of_every_included_rig_is_within_what_is_said(request):
    """Errors count that the study knows to half of themselves; 5 % are for its own scatter."""
    rows = pd.read_csv(request.config.rootpath / "docs" / "measured" / "default_step.csv")
    assert set(rows["rig"]) == set(shipped_rigs())
    rig = load_rig("bench")
    for bare, group in rows.groupby(rows["ring_radius_m"].isna()):
        whole = total_errors(Scene(rig, 150.0, None if bare else rig.ring_radius))
        for row in group[group["uncertainty"] < 0.5 * group["error"].abs()].itertuples():
            accepted = whole(row.measure, row.limit, 0.0)
            assert abs(row.error) <= 1.05 * accepted, (row.rig, row.ring_radius_m, row.rpm, row.measure)


def test_scatter_and_step_are_added_and_a_step_that_is_not_known_gives_no_error(rig):
    scene = Scene(rig, 150.0)
    whole = total_errors(scene)
    of_rms, of_share = (STEP_ERRORS[name][0] for name in ("(rms|sd|mean)_g", "(left|right|ring)_share_pct"))
    assert whole("rms_g", 1.0, 0.0) == of_rms > 0
    assert whole("rms_g", -1.0, 1e-3) == pytest.approx(np.hypot(of_rms, 1e-3))
    assert whole("ring_share_pct", 47.64861, 0.00023) == pytest.approx(np.hypot(of_share, 0.00023))
    assert whole("left_peak_n", 0.0, 0.5) == 0.5 and np.isnan(whole("rms_g", 1.0, np.nan))
    assert total_errors(scene.with_(step=scene.time_step / 2))("rms_g", 1.0, 0.0) == pytest.approx(of_rms / 2)
    assert np.isnan(total_errors(scene.with_(integrator="linearly_implicit", step=5e-4))("rms_g", 1.0, 1e-3))
    assert total_errors(Scene(rig, 150.0, **BELT))("rms_g", 1.0, 1e-4) == 1e-4
    # a measure whose step error is unknown is said to be (`console.measures`)
    for name in (measure.column.name for measure in CATALOGUE if measure.column.text and measure.column.has_error):
        assert np.isnan(whole(name, 1.0, 0.0)) == (name in unknown_step_errors()), name


def test_a_range_that_limits_the_rms_is_said_with_both_values(rig):
    """Nor is a record at no gravity remarked on, but one at another than the earth's."""
    whole, limited, moon, space = (
        belt_recording(Scene(rig.changed(**changes), 150.0, duration=2.0, **BELT))
        for changes in ({}, {"sensor__range": 0.9}, {"gravity": 1.62}, {"gravity": 0.0})
    )
    without, with_it = (shown_measures(run)[0]["value"] for run in (whole, limited))
    (text,) = remarks(limited)
    assert f"RMS is {with_it:.4g} g with this sensor and {without:.4g} g without" in text and with_it < without
    assert "range of 0.9 g" in text and remarks(whole) == remarks(space) == []
    assert "1 g is the rig's gravity of 1.62 m/s2" in remarks(moon)[-1]


def test_the_dictionary_describes_columns_and_refuses_unknown_ones():
    words = "largest normal force on a link on the ring in a passage, mean over passages"
    assert described("ring_peak_n") == ("number", "N", words, "ring_peak_error_n")
    refused(described, "up_peak_n", words=["up_peak_n has no description"])


def test_what_is_printed_is_short(run):
    things = (run, run.scene, run.scene.rig)
    for text in (*map(str, things), *map(repr, things)):
        assert len(text.splitlines()) <= 10 and len(text) < 400
    assert "115 rev/min" in repr(run.scene) and "35 pitches" in repr(run.scene.rig) and repr(run.scene) in repr(run)


@pytest.mark.parametrize(("values", "warnings"), [
    ((1.49, 1.49, 1.58, 1.55, 1.57), True), ((1.49, 1.58, 1.49, 1.57, 1.49), False), ((1.5, 1.5, 1.5, 1.5), False),
    ((1.0, 1.5, 1.6), False), ((1.57, 1.58, 1.55, 1.49, 1.49), True),
])  # fmt: skip
def test_a_record_whose_turns_drift_is_warned_of(run, monkeypatch, values, warnings):
    """Turns of `parts` at 225 rev/min with a ring of 0.308 m, and turns that only scatter, or are too few."""
    per_turn = int(run.rate / run.periods.loop_hz) + 1
    ay = np.outer(values, np.sqrt(2) * np.sin(2 * np.pi * np.arange(per_turn) / per_turn)).ravel()
    monkeypatch.setattr("trackdyn.measure.metrics.sense", lambda *_, **__: SimpleNamespace(ay=ay))
    monkeypatch.setattr("trackdyn.measure.metrics._range_sentence", lambda *_: "")
    sentences = remarks(run)
    assert len(sentences) == warnings
    if warnings:
        assert f"RMS goes from {values[0]:.4g} g in the first turn of the loop to {values[-1]:.4g} g" in sentences[0]


def test_an_interval_knows_how_many_turns_and_batches_it_is_from(rig):
    """Two turns have the factor 12.7; passages are batches of about the root of their number."""
    run = trackdyn.simulate(trackdyn.Scene(rig, 300.0, duration=7.0))
    whole, row = total_errors(run.scene), run_metrics("", run)
    printed = {entry["name"]: entry for entry in shown_measures(run)}
    batches = batch_degrees(row["passages"])
    assert int(run.seconds * run.periods.loop_hz + 1e-9) == 2 and batches > 3
    for name, degrees in (("rms_g", 1), ("ring_share_pct", batches), ("ring_peak_n", batches)):
        error = row[METRIC_COLUMNS[name][3]]
        expected = whole(name, row[name], t.ppf(0.975, degrees) * error)
        assert error > 0 and printed[name]["half_width"] == pytest.approx(expected, rel=1e-9)
        assert printed[name]["error"] == pytest.approx(whole(name, row[name], error))
