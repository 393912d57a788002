"""The variants of a scene: each can be built on the shipped rig, and changes what it says."""

import pytest

from replication.study.departures import variant_scenes
from replication.study.variants import DEPARTURES, PHYSICS, SETTINGS, VARIANTS, change


def test_every_departure_has_its_scenes(rig):
    """All of them are accepted on the shipped rig, one a speed and ring, and differ from it."""
    shipped = variant_scenes(rig)
    for name, variant in DEPARTURES.items():
        scenes = variant_scenes(rig, variant)
        assert scenes.keys() == shipped.keys() and len(scenes) == 4, name
        assert any(scenes[key] != same for key, same in shipped.items()), name


def test_rows_have_a_name_in_one_output_at_least_and_none_has_it_twice():
    for column, rows in (("setting", SETTINGS), ("departure", DEPARTURES), ("physics", PHYSICS)):
        assert len(rows) == sum(bool(getattr(variant, column)) for variant in VARIANTS) > 0
    assert all(any(variant[:3]) for variant in VARIANTS)


def test_shares_change_by_points_and_all_else_by_a_fraction():
    assert change("left_share_pct", 10.0, 8.0) == -2.0
    assert change("rms", 2.0, 2.1) == pytest.approx(0.05)
    assert change("rms", 0.0, 1.0) != change("rms", 0.0, 1.0)  # no fraction of nothing
