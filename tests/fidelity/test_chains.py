"""The simpler chains: one body a pitch, and the kinematic belt."""

import numpy as np
import pytest

from trackdyn import Scene, simulate
from trackdyn.chain.kinematics import bushing_torques
from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import make_arrays
from trackdyn.scene.build import build_chain, build_shoes


def ring_of_teeth(rig, kind):
    """Arcs (13, 2) and ends of the links (26,) of a chain of 13 pitches, clockwise around the sprocket, complex."""
    teeth = rig.sprocket.teeth
    chain, shoes = build_chain(rig, kind), build_shoes(rig, kind)
    # the middle lines of the links touch the circle of the equal pitch plus half a link
    middle = rig.sprocket.equal_pitch_radius + rig.chain.link_thickness / 2
    bodies = teeth * (1 if kind == "single_pin" else 2)
    along = np.exp(-2j * np.pi * np.arange(bodies) / bodies)
    start = (1j * middle - chain.length[0] / 2) * along
    if kind == "double_pin":  # the connector's chord, from the link's end to the next link's begin
        start[1::2] = (1j * middle + chain.length[0] / 2) * along[::2]
    np.testing.assert_allclose(start + chain.length[:bodies] * along, np.roll(start, -1), rtol=0, atol=1e-12)

    def places(body, at):
        body = body % bodies  # the last pitch meets the first one
        return start[body] + at * along[body]

    links = [places(shoes.link_body[:teeth], x[:teeth]) for x in (shoes.link_start, shoes.link_end)]
    return places(shoes.arc_body[: 2 * teeth], shoes.arc_x[: 2 * teeth]).reshape(teeth, 2), np.concatenate(links)


def test_arcs_and_links_stand_where_those_of_the_double_pin_chain_do(rig):
    (arcs, links), (expected_arcs, expected_links) = (ring_of_teeth(rig, k) for k in ("single_pin", "double_pin"))
    np.testing.assert_allclose(arcs, expected_arcs, rtol=0, atol=1e-12)
    np.testing.assert_allclose(links, expected_links, rtol=0, atol=1e-12)
    # left arc first along the run, on the pin circle
    np.testing.assert_allclose(np.abs(arcs), rig.pin_circle, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.abs(arcs[:, 1] - arcs[:, 0]), rig.connector_length, rtol=0, atol=1e-12)


def test_sensor_sits_at_the_same_place_of_its_link(rig):
    for pitch in (1, 12):
        moved = rig.changed(sensor__pitch=pitch, sensor__x=0.03)
        for kind in ("single_pin", "double_pin"):
            model = Scene(moved, 115.0, chain=kind).model
            link = model.shoes
            assert link.link_body[pitch - 1] == model.sensors.body[0]
            assert model.sensors.x[0] - link.link_start[pitch - 1] == pytest.approx(0.03, abs=1e-15)
            assert model.sensors.y[0] == moved.first_sensor.y


def test_a_body_is_a_link_with_half_a_connector_at_each_end(rig):
    single, double = build_chain(rig, "single_pin"), build_chain(rig, "double_pin")
    assert len(single.length) == 35 and len(double.length) == 70
    assert single.mass.sum() == pytest.approx(double.mass.sum(), rel=1e-14)
    assert (single.com_x == single.length / 2).all() and not single.com_y.any()
    c, b, half_mass = rig.chain, rig.connector_length, rig.chain.connector_mass / 2
    # a connector cut in the middle: both halves at b / 4 from the cut have the connector's inertia together
    half_inertia = c.connector_inertia / 2 - half_mass * (b / 4) ** 2
    assert half_inertia > 0
    halves = 2 * (half_inertia + half_mass * (rig.single_pin_pitch / 2 - b / 4) ** 2)
    assert single.mass[0] == pytest.approx(c.link_mass + c.connector_mass, rel=1e-14)
    assert single.inertia[0] == pytest.approx(c.link_inertia + halves, rel=1e-13)


def test_its_bushings_are_two_in_series(rig):
    """A pitch that bends by some angle and rate, half of it at each of the double pins, feels one torque."""
    torque = {}
    for kind in ("single_pin", "double_pin"):
        model = Scene(rig, 0.0, chain=kind).model
        n = len(model.chain.length)
        share = np.arange(n) / n
        state, work, _ = make_arrays(model, METHODS["semi_implicit"])
        state.angle[:], state.rate[:] = -2 * np.pi * share, 35.0 * share  # 1 rad/s a pitch
        bushing_torques(model.chain, state, work)
        torque[kind] = work.torque[: -n // 35]  # the rate closes the loop by a jump at its cut
    np.testing.assert_allclose(torque["double_pin"], torque["double_pin"][0], rtol=1e-12)
    np.testing.assert_allclose(torque["single_pin"], torque["double_pin"][0], rtol=1e-12)
    assert abs(torque["single_pin"][0]) > 0.5  # N m


def test_sensor_of_a_belt_is_the_second_difference_of_its_place(rig):
    """Apart from the ends of the arcs; the sensor is off the middle of its link, the record a little over a turn."""
    rig = rig.changed(sensor__x=0.07)
    recording = simulate(Scene(rig, 150.0, chain="belt", ring_radius=None, contact_log=False, duration=6.5))
    assert recording.gap.max() == 0.0 and len(recording.contact_log) == 0
    turn = np.exp(1j * recording.raw[:, 0, 2])
    position = recording.link_position @ [1, 1j] + turn * (0.07 - rig.chain.link_length / 2 + 1j * rig.first_sensor.y)
    local = np.diff(position, 2) * rig.rate**2 / turn[1:-1]
    raw = recording.raw[:, 0, :2] @ [1, 1j]
    smooth = (raw[2:] == raw[1:-1]) & (raw[1:-1] == raw[:-2])
    assert smooth.mean() > 0.99
    # the fourth derivative: (omega h)^2 / 12 of 3 m/s2, omega 3 1/s and h 1e-3 s; rounding 2e-16 / h^2
    np.testing.assert_allclose(local[smooth], raw[1:-1][smooth], rtol=0, atol=1e-5)
