"""The ladder of fidelities: differences on constructed statistics, and one setting that cannot run."""

import pandas as pd
import pytest

from replication.study.accuracy.ladder import FOUND, compare_rungs


def test_differences_are_those_from_the_papers_setting_in_the_same_scene():
    values = {
        ("preset=paper", "a"): (2.0, 10.0, 1e-14), ("preset=paper", "b"): (4.0, 20.0, 1e-14),
        ("chain=single_pin", "a"): (2.1, 9.0, 2e-14), ("chain=single_pin", "b"): (3.0, 26.0, 2e-14),
    }  # fmt: skip
    found = pd.DataFrame(
        [
            [scene, setting, measure, value, 0.1, ""]
            for (setting, scene), all_values in values.items()
            for measure, value in zip(("rms", "left_share", "loop_gap"), all_values, strict=True)
        ],
        columns=FOUND,
    )
    rows = compare_rungs(found)
    assert list(dict.fromkeys(zip(rows["scene"], rows["setting"], strict=True))) == [
        ("a", "preset=paper"), ("a", "chain=single_pin"), ("b", "preset=paper"), ("b", "chain=single_pin"),
    ]  # fmt: skip
    moved = rows[rows["setting"] == "chain=single_pin"].set_index(["scene", "measure"])["difference_pct"]
    assert moved["a", "rms"] == pytest.approx(5.0)  # percent
    assert moved["b", "rms"] == pytest.approx(-25.0)
    assert moved["a", "left_share"] == pytest.approx(-1.0)  # points
    assert moved["b", "left_share"] == pytest.approx(6.0)
    assert moved[:, "loop_gap"].isna().all()
    assert (rows.loc[rows["setting"] == "preset=paper", "difference_pct"].dropna() == 0).all()
