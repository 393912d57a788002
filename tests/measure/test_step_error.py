"""The whole error of a measure: its scatter, and what the step adds."""

import numpy as np
import pandas as pd
import pytest

from trackdyn.measure.columns import SHOWN, SIDE_COLUMNS, error_of
from trackdyn.measure.metrics import remarks, shown_measures
from trackdyn.measure.uncertainty import whole_errors
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording

BELT = {"chain": "belt", "ring_radius": None, "contact_log": False, "duration": 2.0}
COLUMN = {"rms": "rms_g", "sd": "sd_g", "line": "line_g", "high_frequency": "high_frequency_g"}
COLUMN |= {f"{side}_peak": f"{side}_peak_n" for side in ("left", "right")}
COLUMN |= {f"{side}_share": f"{side}_share_pct" for side in ("left", "right", "ring")}


def test_the_step_of_every_included_rig_is_within_what_is_said(request):
    """Errors count that the study knows to half of themselves; 5 % are for its own scatter."""
    rows = pd.read_csv(request.config.rootpath / "docs" / "measured" / "default_step.csv")
    rings = {"own": 0.308, "none": None}
    whole = {ring: whole_errors(Scene(load_rig("paper"), 150.0, radius)) for ring, radius in rings.items()}
    assert set(rows["rig"]) == set(shipped_rigs())
    for row in rows[rows["uncertainty"] < 0.5 * rows["error"].abs()].itertuples():
        size = 100.0 if row.measure.endswith("_share") else row.limit
        accepted = whole[row.ring](COLUMN[row.measure], row.limit, 0.0)
        assert abs(row.error) * size <= 1.05 * accepted, (row.rig, row.rpm, row.measure)


def test_scatter_and_step_are_added_and_a_step_that_is_not_known_gives_no_error(rig):
    scene = Scene(rig, 150.0)
    whole = whole_errors(scene)
    assert whole("rms_g", 1.0, 0.0) == pytest.approx(1e-3)
    assert whole("rms_g", -1.0, 1e-3) == pytest.approx(np.hypot(1e-3, 1e-3))
    assert whole("ring_share_pct", 47.64861, 0.00023) == pytest.approx(0.02, rel=1e-3)
    assert whole("left_peak_n", 0.0, 0.5) == 0.5 and np.isnan(whole("rms_g", 1.0, np.nan))
    half = whole_errors(scene.with_(step=scene.time_step / 2))
    assert half("rms_g", 1.0, 0.0) == pytest.approx(5e-4)
    assert np.isnan(whole_errors(scene.with_(integrator="linearly_implicit", step=5e-4))("rms_g", 1.0, 1e-3))
    assert whole_errors(Scene(rig, 150.0, **BELT))("rms_g", 1.0, 1e-4) == 1e-4
    # every measure that a run prints with an error has one
    for name in (*SHOWN, *(f"left_{name}" for name in SIDE_COLUMNS)):
        assert " " in error_of(name) or not np.isnan(whole(name, 1.0, 0.0)), name


def test_a_range_that_limits_the_rms_is_said_with_both_values(rig):
    recording = belt_recording(Scene(rig, 150.0, **BELT))
    assert remarks(recording) == []
    small = rig.changed(sensor__range=0.9)
    limited = belt_recording(Scene(small, 150.0, **BELT))
    without, with_it = (shown_measures(run)[0]["value"] for run in (recording, limited))
    (text,) = remarks(limited)
    assert f"RMS is {with_it:.4g} g with this sensor and {without:.4g} g without" in text and with_it < without
    assert "range of 0.9 g" in text


def test_g_of_another_gravity_is_said(rig):
    moon = belt_recording(Scene(rig.changed(gravity=1.62), 150.0, **BELT))
    assert "1 g is the rig's gravity of 1.62 m/s2" in remarks(moon)[-1]
    assert remarks(belt_recording(Scene(rig.changed(gravity=0.0), 150.0, **BELT))) == []
