"""Runs that end when their contacts are known, against long records and on constructed passages."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import trackdyn.measure.stopping as steady
from tests.conftest import recorded
from trackdyn import Scene
from trackdyn.measure.estimators import meshing_summary
from trackdyn.measure.stopping import run_steady, steady_from
from trackdyn.scene.scene import Periods, StopRule, steady_fields

RULE = StopRule(share_pct=0.2, force=0.006, passages=13, longest_turns=4)
TURN = 2.0  # turn of the sprocket in the constructed records, s


def test_a_short_answer_is_that_of_a_long_record(rig):
    """Two revolutions of the loop, begun after three seconds, at half the step."""
    scene = Scene(rig, 210, 0.308, **steady_fields(rig, 210, RULE))
    short, known = run_steady(scene, RULE)
    long = meshing_summary(recorded(scene.with_(lead_in=3.0, duration=9.0, step=scene.time_step / 2)))
    summary = meshing_summary(short)
    assert known and short.seconds < 0.6 * 9.0
    assert 13 <= summary["passages"] < 0.4 * long["passages"]
    for name in ("left_share_pct", "right_share_pct", "ring_share_pct"):
        assert summary[name] == pytest.approx(long[name], abs=RULE.share_pct), name
    for name in ("left_rms_n", "ring_rms_n", "left_sd_n", "ring_sd_n"):
        assert summary[name] == pytest.approx(long[name], rel=RULE.force), name


def judged(monkeypatch, left, square=None):
    """Passages with these shares (%) of the left arc, a tenth of a second apart, as if a recording held them."""
    number, side = np.repeat(np.arange(len(left)), len(steady.SIDES)), list(steady.SIDES) * len(left)
    table = pd.DataFrame({"passage": number, "side": side, "start_s": 1.0 + 0.1 * number})
    for name, values in (("share_pct", left), ("square_n2s", left if square is None else square)):
        table[name] = np.where(table["side"] == "left", np.asarray(values, float)[number], 0.0)
    monkeypatch.setattr(steady, "passages", lambda recording: table)
    scene = SimpleNamespace(rig=None)  # RULE says how many passages there must be
    return steady_from(SimpleNamespace(periods=SimpleNamespace(turn=TURN), scene=scene), RULE)


def test_passages_are_known_when_there_are_enough_for_their_scatter(monkeypatch):
    """Without any, 13; of white noise of 1 point half of the interval is about 2 points over the root of the number."""
    for count, known in ((13, True), (12, False), (0, False)):
        assert judged(monkeypatch, [10.0] * count) == (0.0, known)
    noise = np.random.default_rng(1).normal(10.0, 1.0, 2000)
    assert not judged(monkeypatch, noise[:40])[1]
    assert judged(monkeypatch, noise)[1]
    # a force that scatters by as much is held to its own tolerance
    assert not judged(monkeypatch, [10.0] * 100, square=noise[:100])[1]
    assert judged(monkeypatch, [0.1] * 100, square=noise[:100])[1]  # but not where it hardly touches


def test_a_transient_is_left_out(monkeypatch):
    """The record then begins two thirds of a turn before the first passage that counts."""
    begin, known = judged(monkeypatch, [10.0 + 5.0 * np.exp(-i) for i in range(10)] + [10.0, 10.01] * 20)
    assert known and 4 <= round((begin + 2 / 3 * TURN - 1.0) / 0.1) <= 12


def test_what_is_not_known_ends_with_its_scene(rig):
    """An asked precision below the scatter: the record lasts as long as it may."""
    known = RULE.model_copy(update={"share_pct": 1e-12, "longest_turns": 1.2})
    scene = Scene(rig, 210, 0.308, **steady_fields(rig, 210, known))
    recording, answered = run_steady(scene, known)
    assert not answered
    assert recording.begin + recording.time[-1] == pytest.approx(scene.ramp + 1.2 * Periods.at(rig, 210).loop, abs=2e-3)
