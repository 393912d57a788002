"""Shares of tracks by law, the window of radii, the sentences: recomputed by hand from a small table."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy.stats import beta

from trackdyn_replication.paper.finding import finding_sentences, limit, main_run, of_law, shares, windows

# law, transition velocity, shear stiffness, mobilised friction
SETTINGS = [("regularised", 0.01, np.nan, 0.2), ("regularised", 1.5, np.nan, 0.01), ("dahl", np.nan, 1e4, 0.008),
            ("dahl", np.nan, 6e5, 0.16)]  # fmt: skip


@pytest.fixture
def table():
    """Twenty tracks; a ring that grips frees the right arc on track 0, and on track 1 at 115 rpm only."""
    rows = []
    for (law, velocity, stiffness, grip), draw, rpm in product(SETTINGS, range(20), (115.0, 210.0)):
        free = grip < 0.05 or draw == 0 or (draw == 1 and rpm == 115.0)
        rows.append({
            "draw": draw, "polygon_m": 0.304, "start": 1, "integrator": "linearly_implicit", "rpm": rpm, "law": law,
            "transition_velocity": velocity, "friction_static": 0.3, "shear_stiffness": stiffness, "state": "done",
            "mobilised_friction": grip * (1 + 0.001 * draw), "right_free_from_m": 0.305, "left_lost_from_m": 0.311,
            "right_back_from_m": np.nan if free else 0.309, "conclusion_3": float(free),
            "plateau": float(free and draw < 10),
        })  # fmt: skip
    other = {"integrator": "semi_implicit", "conclusion_3": 1.0, "plateau": 1.0}
    second = [row | {"start": 2} for row in rows[:6]] + [row | other for row in rows[:6]]  # count for nothing
    return pd.DataFrame(rows + second)


def test_shares_are_those_of_the_main_run_by_speed(table):
    counts = shares(table)
    gripping = of_law(counts, "regularised", 210.0).loc[0.01]
    assert (gripping["tracks"], gripping["conclusion_3"], gripping["plateau"]) == (20, 1, 1)
    assert of_law(counts, "regularised", 115.0).loc[0.01, "conclusion_3"] == 2
    assert of_law(counts, "dahl", 210.0)["conclusion_3"].tolist() == [20, 1]
    # Clopper and Pearson by the beta distribution
    ends = [gripping["conclusion_3_low"], gripping["conclusion_3_high"]]
    np.testing.assert_allclose(ends, [beta.ppf(0.05, 1, 20), beta.ppf(0.95, 2, 19)], rtol=1e-6)
    assert len(main_run(table)) == 160


def test_limit_parts_the_rows_with_fewest_errors(table):
    assert 0.0102 < limit(table) < 0.1603  # above track 0, whose arc is free at any friction


def test_window_holds_an_event_that_does_not_come_beyond_the_largest_ring(table):
    rows = windows(table).set_index(["low", "event"])
    slippery = rows.xs("right_back_from_m", level="event").iloc[0]
    assert np.isinf(slippery["q50"])
    assert rows["q50"].xs("right_free_from_m", level="event").round(9).eq(0.001).all()
    assert rows.xs("right_back_from_m", level="event").iloc[-1]["q50"] == pytest.approx(0.005)


def test_sentences_have_the_counts(table):
    words, brief = (" ".join(finding_sentences(table, brief)) for brief in (False, True))
    assert "at 115 rpm on 2 and 20 of 20 tracks" in words and "10 and 1500 mm/s" in words and "on 20 and 2, " in words
    assert "At 210 rpm, run on 20 of them: 1 and 20 and on 20 and 1." in words
    assert "at 115 rpm on 2 to 20 of 20 tracks" in brief and "of 10 to 1500 mm/s" in brief
    assert "on 20 to 2, for a shear stiffness of 10 to 600 kN/m" in brief and "210 rpm" not in brief
