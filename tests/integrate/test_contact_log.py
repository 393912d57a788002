"""The log of contacts with the sprocket: peaks between the steps."""

import numpy as np
import pytest

from trackdyn.integrate.contact_log import log_contacts
from trackdyn.model.arrays import make_record
from trackdyn.simulation.loop import Loop

STEP = 1e-4


def test_a_peak_between_two_steps_is_found(make_scene):
    """A half sine of nine steps a period: of the 6 % that the steps miss 0.7 % are left, at any phase."""
    _, state, work, _ = Loop(make_scene(115.0, ring_radius=None)).arrays
    work.candidates.count[2] = 1  # every arc is looked at
    work.tooth_force[:], work.wheel_force[:] = 0.0, 0.0

    def logged(forces):
        contact_log = make_record(1, state, 1, log_rows=4).contact_log
        for k, force in enumerate([*forces, 0.0]):
            work.tooth_force[4] = force
            log_contacts(contact_log, state, work, 2.0 + k * STEP, STEP)
        assert contact_log.count[0] == 1
        return contact_log.rows[0]

    omega = 2 * np.pi / (9 * STEP)
    missed = []
    for phase in np.linspace(0.02, 0.98, 13):
        times = (phase + np.arange(5)) * STEP
        forces = 800.0 * np.sin(omega * times[omega * times < np.pi])
        interval = logged(forces)
        missed.append(1 - forces.max() / 800.0)
        assert interval["peak_n"] == pytest.approx(800.0, rel=0.007) and interval["peak_n"] >= forces.max()
        assert interval["peak_s"] == pytest.approx(2.0 + 2.25 * STEP - phase * STEP, abs=0.03 * STEP)
        assert interval["impulse_ns"] == pytest.approx(forces.sum() * STEP)
        assert interval["end_s"] - interval["start_s"] == pytest.approx(len(forces) * STEP)
    assert max(missed) > 0.05 and np.mean(missed) == pytest.approx((omega * STEP) ** 2 / 24, rel=0.1)
    # one that the steps do not resolve is the largest step
    for forces in ([9.0, 4.0, 3.0], [1.0, 9.0, 8.0], [3.0, 5.0, 9.0], [7.0, 7.0, 7.0], [9.0]):
        interval = logged(forces)
        assert interval["peak_n"] == max(forces) and interval["peak_s"] == 2.0 + forces.index(max(forces)) * STEP
