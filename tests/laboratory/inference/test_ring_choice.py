"""Choosing a ring: rigs made by hand, whose best radii are known."""

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from laboratory.inference.ensemble.ring_choice import best_radius, choice_table, recommendation
from trackdyn.commands.cli import app
from trackdyn.errors import InputError
from trackdyn.sweeps.table import write_table

RADII = (0.303, 0.305, 0.308, 0.313)


def rig(number, right, left, teeth, ring=(9.0, 9.0, 9.0, 9.0), rpm=115.0):
    return pd.DataFrame({
        "rig": number, "rpm": rpm, "ring_radius_m": RADII, "right_share_pct": right, "left_share_pct": left,
        "left_rms_n": [400, 300, 200, 250], "left_peak_n": 3000.0, "ring_rms_n": 900.0, "ring_peak_n": 5000.0,
        "sliding_teeth_j_km": teeth, "sliding_ring_j_km": ring,
    })  # fmt: skip


STUDY = pd.concat([
    rig(1, [20, 0, 0, 0], [40, 20, 11, 10], [9, 4, 2, 3]),  # teeth 0.308, the rule 0.308: within 2 points of 10
    rig(2, [20, 5, 0, 0], [40, 20, 13, 10], [9, 1, 4, 3]),  # 0.305 slides least, but its right arc touches
    rig(3, [20, 9, 8, 7], [40, 20, 13, 10], [9, 1, 4, 3]),  # no radius serves
    rig(4, [0, 0, 0, 0], [10, 10, 10, 10], [1, 2, 3, 4]),
])  # fmt: skip


def test_the_best_radius_leaves_the_right_arc_free():
    rows = {number: of for number, of in STUDY.groupby("rig")}
    assert [best_radius(rows[k], "teeth") for k in (1, 2, 4)] == [0.308, 0.313, 0.303]
    assert [best_radius(rows[k], "rule") for k in (1, 2, 4)] == [0.308, 0.313, 0.303]
    assert [best_radius(rows[k], "force") for k in (1, 2)] == [0.308, 0.308]
    assert np.isnan(best_radius(rows[3], "teeth"))
    slides = rig(5, [0] * 4, [10] * 4, [1, 2, 3, 4], ring=[9, 3, 3, 3])
    assert best_radius(slides, "teeth") == 0.303 and best_radius(slides, "sliding") == 0.305


def test_chances_are_shares_of_rigs_with_their_interval():
    table = choice_table(STUDY.assign(excluded_by=0), 115).set_index("ring_radius_m")
    assert table["rigs"].eq(4).all()
    assert table["p_right_free"].tolist() == [0.25, 0.5, 0.75, 0.75]
    assert table["p_best_teeth"].tolist() == [0.25, 0, 0.25, 0.25]
    # Clopper and Pearson for 3 of 4
    assert table.loc[0.308, ["p_right_free_low", "p_right_free_high"]].tolist() == pytest.approx(
        [0.1941, 0.9937], abs=1e-4
    )
    assert table.loc[0.308, "left_share_pct"] == pytest.approx(12)
    said = recommendation(table.reset_index(), "teeth")
    assert said.startswith("0.303 m is best in 1 of 4 rigs (95 % interval 1% to 81%)")
    assert said.endswith("in 1 no radius is both free of the right arc and best")


def test_the_command_says_which_and_writes_both(tmp_path):
    write_table(STUDY, tmp_path / "study.csv")
    names = [str(tmp_path / name) for name in ("study.csv", "choice.csv", "choice.png")]
    said = CliRunner().invoke(
        app, ["choose-ring", names[0], "--out", names[1], "--figure", names[2], "--criterion", "rule"]
    )
    assert said.exit_code == 0, said.output
    assert said.output.splitlines()[-1].startswith("115 rpm: 0.303 m is best in 1 of 4 rigs by the smallest radius")
    assert len(pd.read_csv(names[1])) == 4 and (tmp_path / "choice.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("change", "options", "said"),
    [
        ({}, ["--criterion", "taste"], "--criterion = 'taste': choose rule, teeth"),
        ({}, ["--rpm", "200"], "no ring at 200 rpm"),
        ({"left_share_pct": "many"}, [], "left_share_pct = 'many':"),
        ({"rpm": None}, [], "holds no ring"),
        ({}, ["--figure", "a.pdf"], "end in .png"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, change, options, said):
    write_table(STUDY.astype(object).assign(**change), tmp_path / "study.csv")
    result = CliRunner().invoke(app, ["choose-ring", str(tmp_path / "study.csv"), *options])
    assert isinstance(result.exception, InputError) and said in str(result.exception)
