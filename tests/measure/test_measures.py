"""A run in Python: a table of measures, short words, a picture with labels."""

import matplotlib
import pytest

import trackdyn
from trackdyn.measure.metrics import run_metrics


@pytest.fixture(scope="module")
def run(rig):
    return trackdyn.simulate(trackdyn.Scene(rig, 115.0, duration=0.5))


def test_the_table_has_the_values_errors_and_units_of_the_metrics(run):
    table, row = trackdyn.measures(run), run_metrics("", run)
    assert list(table.columns) == ["value", "error", "unit", "measure"] and table.index.name == "name"
    assert {"rms_g", "sd_g", "passages", "clipped_samples"} <= set(table.index)
    assert table["value"].to_dict() == {name: row[name] for name in table.index}
    assert table.loc["rms_g", "unit"] == "g" and table["error"].dtype == float
    assert all(table["measure"].str.len() > 5) and table["value"].notna().all()


def test_what_is_printed_is_short(run):
    for thing in (run, run.scene, run.scene.rig):
        for text in (repr(thing), str(thing)):
            assert len(text.splitlines()) <= 10 and len(text) < 400
    assert "115 rev/min" in repr(run.scene) and "35 pitches" in repr(run.scene.rig) and repr(run.scene) in repr(run)


def test_the_picture_of_the_sensor_has_labels(run):
    matplotlib.use("agg")
    signal = trackdyn.sense(run)
    axes = signal.plot()
    assert axes.get_xlabel() == "time (s)" and axes.get_ylabel() == "acceleration (g)"
    assert [text.get_text().split(",")[0] for text in axes.get_legend().get_texts()] == ["ay", "ax"]
    assert signal.plot(axes) is axes and len(axes.lines) == 4
    assert (axes.lines[0].get_ydata() == signal.ay).all()
