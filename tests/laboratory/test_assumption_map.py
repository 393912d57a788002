"""What the map from assumptions to claims says: cells, sentences, picture, from an invented table."""

import numpy as np
import pandas as pd
import pytest

from laboratory.inference.assumptions import BASE, COLUMNS, FAILED, YARDSTICK
from replication.paper.claims import IN_TREND, NOT_REPRODUCED, REPRODUCED
from laboratory.report.assumptions import assumptions_text, change_table, sentences, speeds_table
from laboratory.report.figures.assumptions import assumptions_figure

SPEEDS = (115.0, 210.0)


def table(cells, outside=""):
    """Rows of a map: ``(group, assumption, instead_of) -> claim -> (verdict, distance)``."""
    rows = []
    for (group, assumption, instead), claims in cells.items():
        about = {"group": group, "assumption": assumption, "instead_of": instead, "origin": "predicted", "text": ""}
        for claim, (verdict, distance) in claims.items():
            own = about | {"claim": claim, "id": claim[:3], "measured": "", "verdict": verdict, "distance": distance}
            own |= {
                "reason": "0.313 m: diverged" if verdict == FAILED else "",
                "outside": outside if group != BASE else "",
            }
            rows += [own | {"rpm": rpm} for rpm in (np.nan, *SPEEDS)]
    return pd.DataFrame(rows, columns=COLUMNS)


YES, NO = REPRODUCED, NOT_REPRODUCED


@pytest.fixture
def rows():
    """C24 asks for viscous drag, C26 for rolling drag, C20 for none; C22 is lost by a run, C18 never happens."""
    base = {"C18": (NO, np.inf), "C20b": (NO, 3.0), "C22a": (YES, 0.1), "C24a": (NO, 2.25), "C26a": (YES, 0.5)}
    viscous = {"C18": (NO, np.inf), "C20b": (NO, 2.5), "C22a": (FAILED, np.nan), "C24a": (YES, 0.75),
               "C26a": (IN_TREND, 1.5)}  # fmt: skip
    coulomb = {"C20b": (NO, 3.02), "C22a": (YES, 0.1), "C24a": (NO, 2.0), "C26a": (YES, 0.5)}
    return table(
        {
            (BASE, "", ""): base,
            (YARDSTICK, "refitted", "the base"): base,
            ("drag law", "viscous", "rolling"): viscous,
            ("drag law", "coulomb", "rolling"): coulomb,
        }
    )


def test_a_cell_is_the_change_of_verdict_and_of_distance(rows):
    cells = change_table(rows).set_index("claim")
    assert list(cells.columns) == [BASE, f"{YARDSTICK}: refitted", "drag law: viscous", "drag law: coulomb"]
    assert cells[BASE].tolist() == ["○ never", "○ 3.00", "● 0.10", "○ 2.25", "● 0.50"]
    assert cells["drag law: viscous"].tolist() == ["", "-0.5", "×", "● -1.5", "◐ +1.0"]
    assert cells["drag law: coulomb"].tolist() == ["–", "0", "0", "-0.2", "0"]
    assert cells[f"{YARDSTICK}: refitted"].tolist() == ["", "0", "0", "0", "0"]


def test_what_happens_under_one_assumption_alone_has_no_difference():
    one = table({(BASE, "", ""): {"C17b": (NO, np.inf)}, ("drag law", "viscous", "rolling"): {"C17b": (YES, 0.4)}})
    assert change_table(one)["drag law: viscous"].tolist() == ["● never to 0.40"]
    assert "reproduces C17b (never to 0.40)" in sentences(one)[1]


def test_sentences_say_what_is_won_lost_and_never_together(rows):
    said = sentences(rows)
    assert said[0] == "The base reproduces 2 of 5 parts of claims."
    assert said[1] == "The refit alone, nothing else changed, changes no verdict."
    assert said[2] == (
        "**drag law: viscous** instead of rolling reproduces C24a (2.25 to 0.75) and costs C26a (0.50 to 1.50); "
        "C22a cannot be judged (0.313 m: diverged)."
    )
    assert said[3] == "**drag law: coulomb** instead of rolling changes no verdict."
    assert said[4] == "C24a needs viscous, C26a rolling or coulomb; no drag law gives both."
    assert said[5] == (
        "No assumption of the map reproduces C18 (never, base) and C20b (2.50, drag law: viscous); in brackets the "
        "nearest approach in tolerances."
    )
    assert len(said) == 6


def test_what_the_refit_alone_gives_is_no_merit_of_a_law(rows):
    again = rows.copy()
    again.loc[(again["group"] == YARDSTICK) & (again["claim"] == "C24a"), ["verdict", "distance"]] = [YES, 0.8]
    said = sentences(again)
    assert (
        "viscous** instead of rolling costs C26a (0.50 to 1.50); C24a is reproduced as with the refit alone" in said[2]
    )
    assert not any("gives both" in sentence for sentence in said)


def test_one_law_that_gives_both_is_no_conflict(rows):
    both = rows.copy()
    both.loc[(both["assumption"] == "coulomb") & (both["claim"] == "C24a"), ["verdict", "distance"]] = [YES, 0.9]
    assert not any("gives both" in sentence for sentence in sentences(both))


@pytest.mark.parametrize(("far", "conflict"), [(1.1, False), (1.3, True)])
def test_a_claim_that_is_lost_by_less_than_the_resolution_is_in_no_conflict(rows, far, conflict):
    near = rows.copy()
    near.loc[(near["assumption"] == "viscous") & (near["claim"] == "C26a"), ["verdict", "distance"]] = [NO, far]
    assert any("gives both" in sentence for sentence in sentences(near)) == conflict


def test_a_claim_that_was_not_judged_everywhere_is_in_no_conflict(rows):
    """C22a comes out without viscous drag, under which it could not be judged."""
    assert not any("C22a" in sentence for sentence in sentences(rows) if "gives both" in sentence)


def test_a_value_outside_its_range_is_the_price(rows):
    beyond = table(
        {(BASE, "", ""): {"C24a": (NO, 2.0)}, ("creep", "0.03 s/m", "fitted"): {"C24a": (YES, 0.5)}}, "2 to 90"
    )
    assert "(outside: 2 to 90)" in sentences(beyond)[1]


def test_text_and_picture_survive_a_file(rows, tmp_path):
    """As the pages are filled: from a CSV, where empty texts are missing values."""
    path = tmp_path / "assumptions.csv"
    rows.to_csv(path, index=False)
    read = pd.read_csv(path)
    assert assumptions_text(read) == assumptions_text(rows)
    figure = assumptions_figure(read)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert texts.count("×") == 1
    assert len(figure.axes[0].patches) == len(rows.dropna(subset="rpm"))
    # what is judged over all speeds together has one patch
    together = rows[rows["rpm"].isna() | (rows["claim"] != "C24a")]
    fewer = len(rows.dropna(subset="rpm")) - 2 * 4 + 4
    assert len(assumptions_figure(together).axes[0].patches) == fewer


def test_distances_of_the_base_at_each_speed(rows):
    cells = speeds_table(rows).set_index("claim")
    assert list(cells.columns) == ["115 rpm", "210 rpm"]
    assert cells.loc["C24a"].tolist() == ["2.25", "2.25"]
    assert cells.loc["C18"].tolist() == ["never", "never"]
