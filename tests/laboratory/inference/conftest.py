"""A track in closed form: what a sensor would report if stiffness, damping and tension each set one line."""

import numpy as np
import pytest

from laboratory.inference.identification import experiment
from trackdyn.scene.scene import Periods


def closed_form_ay(rig, speed, turns, starts=None):
    """ay in g: the turn of the loop, pitches whose first and second harmonic tell stiffness and tension, a ring that
    tells damping.
    """
    period = Periods.at(rig, speed.rpm).loop
    rate = speed.rate / speed.every
    phase = 2 * np.pi * np.arange(int(turns * period * rate) + 2) / rate / period
    stiff, tight = np.log(rig.bushing.stiffness / 600), np.log(rig.tension.pre_tension / 5000)
    damped = np.log(rig.bushing.loss_factor / 0.125)
    pitches = rig.chain.pitches
    high = round(70 * period)  # order of a line at 70 Hz
    return (
        1.1 * np.cos(phase)
        + 0.3 * np.cos(3 * phase)
        + 0.5 * np.exp(0.5 * stiff) * np.cos(pitches * phase)
        + 0.2 * np.exp(0.7 * tight + 0.1 * stiff) * np.cos(2 * pitches * phase)
        + 0.1 * np.exp(-0.6 * damped) * np.cos(high * phase)
    )


@pytest.fixture
def closed_form(monkeypatch):
    """Simulations replaced by `closed_form_ay`, which does not turn through gravity as a track does."""
    monkeypatch.setattr(experiment, "simulated_ay", closed_form_ay)
    monkeypatch.setattr("laboratory.inference.identification.measured.require_axes", lambda *_: None)
    return closed_form_ay
