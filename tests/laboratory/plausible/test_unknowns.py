"""Unknowns: from the unit cube to rigs and back, and refusals."""

import numpy as np
import pytest

from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from tests.conftest import ROOT, refused
from trackdyn.rig.rig import load_rig

RIG = load_rig("paper")
RANGES = file_ranges(ROOT / "trackdyn" / "rigs" / "paper.yaml")
STIFFNESS = Unknown(names=["bushing.stiffness"], scale="log")


def test_a_point_becomes_a_rig_and_is_found_again():
    """Geometric middle of a log range, arithmetic of a linear one; the ratio follows its denominator."""
    damping = Unknown(names=["bushing.damping"], of="bushing.stiffness", low=0.002, high=0.01)
    drag = Unknown(names=["idler.bearing_drag", "road_wheel.bearing_drag"])
    unknowns = Unknowns([STIFFNESS, damping, drag], RIG, RANGES)
    rig = RIG.changed(**unknowns.changes(unknowns.values([0.5, 0.5, 0.5])))
    low, high = RANGES["bushing.stiffness"]
    assert rig.bushing.stiffness == pytest.approx((low * high) ** 0.5)
    assert rig.bushing.damping == pytest.approx(0.006 * rig.bushing.stiffness)
    assert rig.wheels["idler"].bearing_drag == rig.wheels["road_wheel"].bearing_drag == pytest.approx(31)
    stiffness = STIFFNESS.model_copy(update={"low": low, "high": high})
    assert stiffness.position(rig.bushing.stiffness) == pytest.approx(0.5) and np.isnan(stiffness.position(1.01 * high))


@pytest.mark.parametrize(("name", "range_", "message"), [
    ("bushing.stifness", {"low": 1, "high": 2}, "'bushing.stifness' is not a parameter of the rig"),
    ("bushing.stiffness", {"low": 2, "high": 1}, "range 2 to 1: bounds must be rising"),
    ("bushing.stiffness", {"low": 0, "high": 1, "scale": "log"}, "bounds must be rising and above 0"),
    ("sprocket.ring_radius", {}, "has no range"), ("bushing.damping", {"low": 1, "high": 2}, "occurs twice"),
])  # fmt: skip
def test_an_invalid_unknown_is_refused_in_a_sentence(name, range_, message):
    twice = Unknown(names=["bushing.damping"], low=1, high=2)
    refused(lambda: Unknowns([twice, Unknown(names=[name], **range_)], RIG, RANGES), words=[message])
