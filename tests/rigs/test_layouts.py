"""Random layouts in short; the rule `layouts` has a thousand."""

from math import hypot

import numpy as np
import pytest

from replication.study.extremes.judge import COMPLETED
from replication.study.layouts import PITCHES, WHEELS, random_rig, run_layout
from trackdyn.errors import InputError
from trackdyn.parameters.layout import assemble, belt_around, wheel_circles
from trackdyn.simulation.settling import settle


def test_layouts_are_drawn_again_from_their_numbers():
    for number in range(12):
        rig, words = random_rig(number)
        again, _ = random_rig(number)
        assert rig == again
        assert PITCHES[0] <= words["pitches"] == rig.chain.pitches <= PITCHES[1]
        assert WHEELS[0] <= words["wheels"] == 1 + len(rig.rollers) <= WHEELS[1]
    assert random_rig(0)[0] != random_rig(1)[0]


@pytest.mark.parametrize("number", range(25))
def test_a_drawn_layout_is_laid_exactly(number):
    """Every wheel is met, no two overlap, and the chain closes on itself: by the pins alone."""
    rig, words = random_rig(number)
    single = rig.chain.kind == "single_pin"
    lengths = np.full(rig.chain.pitches, rig.single_pin_pitch) if single else None
    laid = assemble(rig, lengths)
    lengths = np.tile([rig.chain.link_length, rig.connector_length], rig.chain.pitches) if lengths is None else lengths
    path, order = belt_around(rig, laid.shift, float(lengths[0]))
    assert set(order) == set(range(words["wheels"])) and path.wrap.sum() == pytest.approx(2 * np.pi)
    closed = np.array([np.cos(laid.angle), np.sin(laid.angle)]) @ lengths
    assert np.abs(closed).max() < 1e-10
    circles = wheel_circles(rig, laid.shift, surface=True)
    apart = [
        hypot(*(circles[i, :2] - circles[k, :2])) - circles[i, 2] - circles[k, 2]
        for i in range(len(circles))
        for k in range(i)
    ]
    assert min(apart) > 0


@pytest.mark.parametrize("number", [3, 7, 8])
def test_a_drawn_layout_settles_and_runs(number):
    row = run_layout(number, 0.2)
    assert row["outcome"] == COMPLETED, row["reason"]
    assert row["depth_m"] <= row["depth_allowed_m"]
    assert row["loop_gap_max_m"] < 1.1e-10


def test_a_tension_that_the_hanging_chain_exceeds_is_refused():
    """Layout 122 hangs 3.2 kN of its chain below the strand: a third of that cannot be its tension, whatever the wheel
    does.
    """
    rig, _ = random_rig(122)
    with pytest.raises(InputError, match=r"pre_tension = 1100 N: must exceed .*3\d+ N of chain hang below"):
        settle(at_an_allowed_step(rig.changed(tension__pre_tension=1100.0), 0.4))
