"""Features of records in closed form, and the covariance that a record gives of them."""

import numpy as np
import pytest

from laboratory.inference.identification.features import (
    FLOOR_G,
    covariance,
    features,
    features_of,
    turn_statistics,
)
from trackdyn.errors import InputError

RATE, PERIOD, PITCHES = 1000.0, 4.2, 35
NAMES = [feature.name for feature in features_of(RATE)]


def played(turns=6, shift=0.0, noise=0.0, seed=0):
    """Orders 1, 2 and 35 of the loop, with amplitudes 1, 0.3 and 0.4 g, on an offset of 0.2 g."""
    phase = 2 * np.pi * (np.arange(round(turns * PERIOD * RATE)) / RATE / PERIOD + shift)
    ay = 0.2 + np.cos(phase) + 0.3 * np.sin(2 * phase) + 0.4 * np.cos(PITCHES * phase)
    return ay + noise * np.random.default_rng(seed).standard_normal(ay.size)


def features_from(ay):
    return dict(zip(NAMES, features(turn_statistics(ay, RATE, PERIOD, PITCHES), RATE), strict=True))


def test_lines_and_passing_of_pitches_are_their_amplitudes():
    seen = features_from(played())
    floor = FLOOR_G**2
    assert seen["line_1"] == pytest.approx(0.5 * np.log(1 + floor), abs=1e-6)
    assert seen["line_2"] == pytest.approx(0.5 * np.log(0.09 + floor), abs=1e-6)
    assert seen["line_3"] == pytest.approx(np.log(FLOOR_G), abs=1e-6)  # nothing there
    assert seen["passing_1"] == pytest.approx(0.5 * np.log(0.4**2 / 2 + floor), abs=1e-6)
    assert seen["sd"] == pytest.approx(0.5 * np.log((1 + 0.09 + 0.16) / 2 + floor), abs=1e-6)
    assert seen["band_6_12_hz"] == pytest.approx(0.5 * np.log(0.4**2 / 2 + floor), abs=1e-6)  # order 35 at 8.3 Hz
    assert seen["band_25_50_hz"] == pytest.approx(np.log(FLOOR_G), abs=1e-6)


def test_when_a_record_begins_does_not_matter():
    first, second = features_from(played()), features_from(played(shift=0.377))
    for name in NAMES:  # the largest of discrete samples and their quantiles move with the samples' places
        assert first[name] == pytest.approx(second[name], abs=2e-3 if name.startswith(("peak", "tail")) else 1e-6), name


def test_covariance_is_the_scatter_of_records():
    """Features of 300 noisy records scatter as the covariance that one of them gives, the smallest records allowed
    aside.
    """
    noise, turns = 0.3, 24
    recorded = np.array(
        [features(turn_statistics(played(turns, 0, noise, seed), RATE, PERIOD, PITCHES), RATE) for seed in range(300)]
    )
    estimated = np.mean(
        [
            np.diag(covariance(turn_statistics(played(turns, 0, noise, seed), RATE, PERIOD, PITCHES), RATE))
            for seed in range(8)
        ],
        axis=0,
    )
    ratio = estimated / recorded.var(axis=0)
    # 8 records of 24 turns each know a variance to 1/sqrt(96) = 10 %, 300 records theirs to 8 %; Student's factor is
    # 1.095
    assert (ratio > 1.095 * 0.6).all() and (ratio < 1.095 * 1.6).all(), dict(zip(NAMES, ratio.round(2), strict=True))


def test_a_short_record_is_refused():
    statistics = turn_statistics(played(3), RATE, PERIOD, PITCHES)
    with pytest.raises(InputError, match="3 whole turns of the loop; at least 4 are needed"):
        covariance(statistics, RATE)
