"""The variants of a scene: each can be built on the shipped rig, and changes the setting that it names."""

import pandas as pd
import pytest

from trackdyn.measure.catalogue import ABSOLUTE, TOLERATED
from trackdyn.scene.choices import PRESETS
from trackdyn.scene.scene import Scene
from trackdyn_replication.report.fidelity import ladder_table
from trackdyn_replication.report.filled import departures_text
from trackdyn_replication.study.accuracy.ladder import MEASURED, compare_rungs
from trackdyn_replication.study.variants import PHYSICS, REFERENCE, SETTINGS, VARIANTS


def test_every_variant_is_a_scene_of_the_shipped_rig_and_differs_from_the_reference(rig):
    laws = {"drag": rig.drag, "bushing_law": rig.bushing.law}  # the variant of a law that the rig has is the reference
    same = [f"preset={REFERENCE}", *(f"{name}={law}" for name, law in laws.items())]
    for ring in (None, 0.308):
        reference = PRESETS[REFERENCE] | {"tension": "locked", "ring_radius": ring}
        for variant in VARIANTS:
            scene = Scene(rig.changed(**variant.rig), 115.0, **reference | variant.scene)
            assert (scene == Scene(rig, 115.0, **reference)) == (variant.name in same), variant.name
    assert len(SETTINGS) == len(VARIANTS) and len(PHYSICS) == sum(bool(variant.physics) for variant in VARIANTS)


def test_a_departure_has_its_largest_change_and_says_what_is_not_possible():
    settings = {f"preset={REFERENCE}": 1.0, "drag=coulomb": 1.02, "tension=sprung": float("nan"), "chain=belt": 2.0}
    scenes = {"a scene": settings, "another": settings | {"drag=coulomb": 0.9, "friction=none": 1.0}}
    rungs = ([scene, name, measure, value, 0.1, ""] for scene, values in scenes.items()
             for name, value in values.items() for measure in TOLERATED + ABSOLUTE)  # fmt: skip
    lines = departures_text(ladder_table(compare_rungs(pd.DataFrame(rungs, columns=MEASURED)))).splitlines()[2:]
    assert [cell.strip() for cell in lines[0].strip("|").split("|")] == ["`drag=coulomb`", "-10.0", "-10.0", "-0.1"]
    assert lines[2:] == ["No change: `friction=none`.", "", "Not possible: `tension=sprung`."]


def test_shares_change_by_points_and_all_else_by_percent():
    values = {"left_share": (10.0, 8.0), "rms": (2.0, 2.1), "sd": (0.0, 1.0), "loop_gap": (1.0, 2.0)}
    names = (f"preset={REFERENCE}", "drag=coulomb")
    rungs = (["a scene", name, measure, pair[k], 0.1, ""] for k, name in enumerate(names)
             for measure, pair in values.items())  # fmt: skip
    changes = compare_rungs(pd.DataFrame(rungs, columns=MEASURED))["difference_pct"].iloc[len(values) :]
    # no fraction of nothing; a closure error is compared with none
    assert changes.tolist() == pytest.approx([-2.0, 5.0, float("nan"), float("nan")], nan_ok=True)
