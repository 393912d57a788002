"""The account of sliding against the energy balance, and against Eq. 10 written anew."""

import numpy as np
import pytest

from trackdyn import Loop, Scene, load_rig
from trackdyn.errors import InputError
from trackdyn.model.arrays import ENERGY_NAMES, FLANK, components
from trackdyn.parameters.outline import ToothProfile
from trackdyn.simulation.recording import load_recording
from trackdyn.simulation.simulate import simulate

RIG = load_rig("paper")
TOOTH_AREAS = len(RIG.groove_profile.radius)


@pytest.fixture(scope="module")
def recording():
    return simulate(Scene(RIG, 115, 0.305, lead_in=0.5, duration=1.0, sliding=True))


def test_it_adds_up_to_the_friction_in_the_account_of_work(recording):
    """Teeth over areas, links over wheels, to 1e-6 of the work; a term booked twice or nowhere would be a share
    of it.
    """
    change = dict(zip(ENERGY_NAMES, recording.energy[-1] - recording.energy[0], strict=True))
    slid = recording.sliding[-1] - recording.sliding[0]
    assert change["tooth_friction"] > 1.0 and change["wheel_friction"] > 1.0
    assert slid[:TOOTH_AREAS].sum() == pytest.approx(change["tooth_friction"], rel=1e-6)
    assert slid[TOOTH_AREAS:].sum() == pytest.approx(change["wheel_friction"], rel=1e-6)


def coulomb(law, slip):
    """Eq. 10 from the paper's text: ``mu_d tanh(4 x) + (mu_s - mu_d) x / (x^2 / 4 + 3 / 4)^2``, x the slip over v_t."""
    x = slip / law.transition_velocity
    return (
        law.friction_dynamic * np.tanh(4 * x)
        + (law.friction_static - law.friction_dynamic) * x / (x**2 / 4 + 0.75) ** 2
    )


def test_it_is_normal_force_times_friction_times_slip():
    """Summed from the contact list at both ends of every step; a step of 1e-5 s leaves 1 % to the path in between."""
    loop = Loop(Scene(RIG, 115, 0.305, ramp=0.5, step=1e-5, sliding=True))
    loop.advance(1.0)
    before, power = loop.work.sliding.copy(), np.zeros_like(loop.work.sliding)
    laws = {True: loop.model.tooth.law}
    steps = 1500
    for k in range(steps + 1):
        row = loop.work.contact[: loop.work.count[0]]
        normal = np.hypot(row["normal_x"], row["normal_y"])
        nx, ny = (row[name] / np.maximum(normal, 1e-12) for name in ("normal_x", "normal_y"))
        speed = components(row, "speed") - row["rate"][:, None] * components(row, "turn")
        slip = -ny * speed[:, 0] + nx * speed[:, 1]
        for i in range(len(row)):
            on_teeth = row["kind"][i] == FLANK
            ring = loop.model.wheels.ring_law if row["wheel"][i] == 0 else loop.model.wheels.wheel_law
            law = laws.get(on_teeth, ring)
            entry = row["area"][i] - 1 if on_teeth else TOOTH_AREAS + row["wheel"][i]
            weight = 0.5 if k in (0, steps) else 1.0
            power[entry] += weight * normal[i] * abs(float(coulomb(law, slip[i])) * slip[i])
        if k < steps:
            loop.step()
    work = loop.work.sliding - before
    assert work[1] > 0 and row["body"].max() < loop.scene.bodies
    np.testing.assert_allclose(work, 1e-5 * power, rtol=0.01, atol=1e-3 * work.max())


def test_it_is_kept_only_where_it_is_asked_for_and_changes_nothing(recording):
    """The rest of the record is the same to the last bit."""
    plain = simulate(Scene(RIG, 115, 0.305, lead_in=0.5, duration=1.0))
    assert plain.sliding.size == 0
    np.testing.assert_array_equal(plain.raw, recording.raw)
    np.testing.assert_array_equal(plain.energy, recording.energy)


@pytest.mark.parametrize(
    "fields",
    [
        {"integrator": "rk4"},
        {"loop": "free", "ring_radius": None},
        {"chain": "belt", "ring_radius": None, "contact_log": False},
    ],
)
def test_what_keeps_no_such_account_is_refused(fields):
    with pytest.raises(InputError, match="sliding = True:"):
        Scene(RIG, 115, **{"sliding": True} | fields)


PARTS = 7  # of area 2, and so of its mirror image
DESIGN = np.repeat(np.arange(TOOTH_AREAS), [1, PARTS, 1, 1, 1, 1, 1, 1, PARTS, 1])  # area of the design of each arc


def more_arcs():
    """The rig with area 2 in parts: every other one is wider by 0.1 um, without which joints have no slope."""
    groove, wider = RIG.groove_profile, 1e-7
    tip, seat, *rest = np.column_stack([groove.centre, groove.radius, np.where(groove.convex, 1.0, -1.0)])[:5]
    parts = [seat]
    for k in range(1, PARTS):
        turn, change = groove.half_angle[1] * (2 * k / PARTS - 1), wider if k % 2 else -wider
        joint = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ groove.direction[1]
        parts.append(parts[-1] + [*(-change * joint), change, 0.0])
    return RIG.changed(groove=None, profile=ToothProfile(arcs=[list(row) for row in (tip, *parts, *rest)]))


def test_a_groove_of_more_arcs_has_an_entry_for_each(tmp_path):
    """Eleven arcs a flank, the same surface to 0.1 um: what slides on the parts of an area is what slides on it, and on
    the wheels, too, and the recording can be read. Differences of the surface change it by 1e-5 (measured).
    """
    fields = {"ring_radius": None, "lead_in": 0.5, "duration": 0.6, "ramp": 0.4, "sliding": True}
    split, plain = (simulate(Scene(rig, 115, **fields)) for rig in (more_arcs(), RIG))
    work, expected = (run.sliding[-1] - run.sliding[0] for run in (split, plain))
    areas = len(DESIGN)
    assert len(work) == areas + plain.wheel_rate.shape[1]
    assert work[TOOTH_AREAS:areas].sum() > 1.0, "areas are touched that a groove of ten arcs has not"
    close = {"rtol": 1e-3, "atol": 1e-4 * expected.max()}
    np.testing.assert_allclose(np.bincount(DESIGN, work[:areas]), expected[:TOOTH_AREAS], **close)
    np.testing.assert_allclose(work[areas:], expected[TOOTH_AREAS:], **close)
    split.save(tmp_path / "run.npz")
    np.testing.assert_array_equal(load_recording(tmp_path / "run.npz").sliding, split.sliding)
