"""Ranges: one rig has every value within its own, and jointly; the others say which they have outside."""

from math import pi
from pathlib import Path

import numpy as np
import pytest

from laboratory.inference.ensemble.settings import load_ensemble
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.parameters.table import parameter_table
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

CONFIG = Path(__file__).parents[2] / "config"
RPM = 115.0


@pytest.fixture(scope="module")
def rig():
    return load_rig("possible")


@pytest.fixture(scope="module")
def table():
    return parameter_table(shipped_rigs()["possible"]).set_index("name")


def test_every_value_is_what_the_part_can_be(table):
    assert not list(table.index[table["outside"] != ""])
    fitted = table[table["kind"] == "fitted"]
    assert len(fitted) > 10 and fitted[["low", "high"]].notna().all(axis=None)


def test_what_hangs_together_is_within_its_range_together(rig, table):
    """The ranges and ratios of the ensemble; creep slope; the damper that stands for the loss factor."""
    for unknown in load_ensemble(CONFIG / "ensemble.yaml").unknowns:
        for name in unknown.names or ():
            value = rig.value(name)
            if unknown.of is not None:
                assert unknown.low <= value / rig.value(unknown.of) <= unknown.high, name
            elif unknown.ranges:
                assert any(low <= value <= high for low, high in unknown.ranges), name
    for surface in (rig.ring_contact, rig.wheel_contact, rig.tooth_contact):
        assert 0.6 <= surface.friction_dynamic / surface.friction_static <= 1.0
    slopes = table.loc[["ring_contact.friction_static", "ring_contact.transition_velocity"], ["low", "high"]].astype(
        float
    )
    friction, velocity = slopes.to_numpy()
    slope = rig.ring_contact.friction_static / rig.ring_contact.transition_velocity
    assert friction[0] / velocity[1] <= slope <= friction[1] / velocity[0]
    passing = 2 * pi * RPM / 60 / rig.sprocket.transmission_ratio * rig.sprocket.teeth
    low, high = table.loc["bushing.loss_factor", ["low", "high"]]
    assert low <= rig.bushing.damping * passing / rig.bushing.stiffness <= high


def test_drag_of_every_law_is_a_lever_that_rubber_has_times_the_load(rig, table):
    """The viscous and the constant drag are those of rolling resistance at 115 rpm, wheel by wheel."""
    loop = Loop(Scene(rig, RPM, step=1e-4))
    loop.advance(1.5)
    seen = []
    for _ in range(200):
        loop.step(50)
        seen.append([loop.work.carried[1:].copy(), np.abs(loop.wheel_rates[1:])])
    load, rate = np.mean(seen, axis=0)
    low, high = table.loc["idler.rolling_arm", ["low", "high"]]
    for wheel, force, turning in zip(rig.rollers.values(), load, rate, strict=True):
        assert low <= wheel.rolling_arm <= high
        assert low <= wheel.bearing_drag * turning / force <= high
        assert low <= wheel.bearing_torque / force <= high
