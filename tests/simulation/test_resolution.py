"""Is a record resolved by its step? Judged from the first contacts on, whatever the record's length."""

import numpy as np
import pytest

from trackdyn.errors import DivergenceError
from trackdyn.measure.metrics import run_metrics
from trackdyn.model.record import PEAK, PEAK_TIME, PITCH
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.resolution import (
    FLIPS,
    LEAST_PITCHES,
    NO,
    NOTICED,
    ONE_STEP,
    OPEN,
    PEAKS,
    RMS,
    YES,
    Answer,
    doubt,
    largest_forces,
    passed_pitches,
    resolution,
)
from trackdyn.simulation.simulate import simulate
from trackdyn.simulation.trial import Trial, try_steps


@pytest.fixture(scope="module")
def running(make_scene):
    return Loop(make_scene(115.0, ring_radius=None))


def sums(model, share, looks=100):
    """Sums of a record in which ``share`` of the mean square of 1 g alternates."""
    return np.array([looks * share * (9.81 * model.step) ** 2, looks])


def level(samples):
    return np.zeros((samples, 3))


@pytest.mark.parametrize("share", [0.0, 0.9 * NOTICED, 1.1 * NOTICED, 5.0])
@pytest.mark.parametrize("alone", [0.0, 1.1 * ONE_STEP])
@pytest.mark.parametrize("seconds", [0.7, 5.0])
def test_what_alternates_and_peaks_of_one_step_are_doubted_at_every_length(running, share, alone, seconds):
    found = doubt(sums(running.model, share), running.model, level(1000), seconds, alone)
    assert bool(found) == (share > NOTICED or alone > ONE_STEP)


@pytest.mark.parametrize(
    ("off", "state"), [((np.nan, np.nan), NO), ((0.0, 0.0), YES), ((0.6 * RMS, 0.0), NO), ((0.0, 0.6 * PEAKS), NO)]
)
def test_a_finer_step_decides_what_is_doubtful(running, off, state):
    found = resolution(sums(running.model, 0.9 * FLIPS), running.model, level(1000), 1.0, "it flips", off)
    assert found.state == state and found.share == pytest.approx(0.9 * FLIPS)
    assert bool(found.reason) == (state != YES)
    # steps that flip are never called resolved: their samples are not
    assert resolution(sums(running.model, 1.1 * FLIPS), running.model, level(1000), 1.0, "it flips", off).state == NO


def test_too_few_contacts_are_not_judged(running):
    """What is wrong shows with the first pitches, what is right only after some."""
    model = running.model
    pitch = 1.0 / passed_pitches(model, 1.0)
    untried = np.nan, np.nan
    found = resolution(sums(model, 0.0), model, level(100), 0.9 * LEAST_PITCHES * pitch, "", untried)
    assert found.state == OPEN and "too few" in found.reason
    assert doubt(sums(model, 2 * NOTICED), model, level(100), 1.1 * pitch, 0.0)
    assert not doubt(sums(model, 2 * NOTICED), model, level(100), 0.9 * pitch, 0.0)  # one impact
    assert resolution(np.zeros(2), model, level(100), 9.0, "", untried).state == OPEN  # steps that are not watched


def test_answers_are_compared_over_the_same_pitches():
    """A pitch that is only just touched with the finer step moves the mean of those that touch by a ninth."""
    rows = np.zeros((4, 11))
    rows[:, PITCH], rows[:, PEAK], rows[:, PEAK_TIME] = [0, 0, 1, 2], [50.0, 100.0, 80.0, 1.0], [0.1, 0.2, 0.30005, 0.4]
    largest, alone = largest_forces(rows, 5, 1e-4)
    assert largest[:, 0].tolist() == [100.0, 80.0, 1.0, 0.0, 0.0]
    assert alone[:, 0].tolist() == [100.0, 0.0, 1.0, 0.0, 0.0]  # the second lies between two steps

    def found(rms, peaks):
        return Answer(np.array(rms), np.array(peaks), 0.0)

    fine = found([2.0, 1.0], [100.0, 20.0, 90.0])
    assert found([2.0, 1.0], [101.0, 99.0, 90.0]).differs(fine) == (
        0.0,
        pytest.approx(0.01),
    )  # little lies there
    assert found([2.0, 1.1], [100.0, 20.0, 45.0]).differs(fine) == (pytest.approx(0.1), 0.5)
    assert found([0.0], [0.0] * 3).differs(found([0.0], [0.0] * 3)) == (0.0, 0.0)


def test_a_short_run_that_is_resolved_completes_and_says_so(make_scene):
    recording = simulate(make_scene(115.0, ring_radius=None, ramp=0.3, lead_in=0.0, duration=0.7))
    assert recording.meta["resolved"]["state"] == YES
    assert 0.0 < recording.meta["resolved"]["share"] < NOTICED
    assert run_metrics("x", recording)["resolved"] == YES


def test_a_record_that_flips_and_holds_with_a_finer_step_completes_and_says_so(make_scene, monkeypatch):
    """Doubt that a finer run does not share is said, not refused."""
    monkeypatch.setattr("trackdyn.simulation.watch.doubt", lambda *_: "it flips")
    monkeypatch.setattr("trackdyn.simulation.resolution.FLIPS", -1.0)
    found = simulate(make_scene(150.0, lead_in=0.1)).meta["resolved"]
    assert found["state"] == NO and "it flips, and with a finer step RMS differs by 0.0" in found["reason"]


def test_a_doubtful_record_that_was_steered_is_not_run_again(make_scene, monkeypatch):
    """Another run would be another motion; what is doubted stays so."""
    monkeypatch.setattr("trackdyn.simulation.watch.doubt", lambda *_: "it flips")
    loop = Loop(make_scene(115.0, ring_radius=None))
    loop.advance(0.3)
    steered = loop.copy()
    assert loop.record(0.5).meta["resolved"]["state"] == YES
    found = steered.record(0.5, tick=lambda _: steered.drive(100.0, 0.2)).meta["resolved"]
    assert found["state"] == NO and "it flips; compare" in found["reason"]


def test_a_run_shorter_than_a_turn_of_the_loop_is_run_again(make_scene, monkeypatch):
    """Nothing flips, no peak stands for one step, and the RMS of one link may be off all the same."""
    tried, off = [], [0.0, 0.0]

    def differs(self, finer):
        tried.append(self)
        return tuple(off)

    monkeypatch.setattr(Answer, "differs", differs)
    scene = make_scene(115.0, ring_radius=None)

    def state(scene=scene):
        return simulate(scene).meta["resolved"]["state"]

    assert state() == YES and len(tried) == 1
    off[0] = 0.6 * RMS
    assert state() == NO
    off[0] = 1.1 * RMS
    with pytest.raises(DivergenceError, match="shorter than a turn of the loop"):
        state()
    # not: a part of a run, less than a pitch, a turn of the loop
    tried.clear()
    loop = Loop(scene)
    loop.advance(0.6)
    assert loop.record(0.7).meta["resolved"]["state"] == YES and not tried
    assert state(scene.with_(duration=0.05)) == OPEN and not tried
    with monkeypatch.context() as turn:
        turn.setattr("trackdyn.simulation.watch.passed_pitches", lambda *_: 35.0)
        assert state() == OPEN and not tried  # too few pitches, and no trial that tells
    off[0] = 0.0
    for name in ("PIECE", "BETWEEN"):
        monkeypatch.setattr(f"trackdyn.simulation.watch.{name}", 0.25)
    assert state() == YES and len(tried) == 1, "the first piece alone"


def test_watching_a_run_changes_nothing(make_scene):
    """Looks fall on the same steps however a record is cut, and a checkpoint goes on with their sums."""
    loop = Loop(make_scene(115.0, ring_radius=None))
    loop.advance(0.3)
    other = loop.copy()
    one, two = loop.record(0.5), other.record(0.25)
    np.testing.assert_array_equal(one.mean[:250], two.mean)
    assert one.meta["resolved"]["share"] != two.meta["resolved"]["share"]


def test_a_trial_halves_until_the_answer_holds(running):
    found = try_steps(running, 115.0)
    assert found.step == found.tried[-2] and found.tried[0] == 1e-4
    assert "tried" in str(found) and "no step" in str(Trial(None, (1e-4,)))
    assert running.time == 0.0


def test_every_shipped_rig_has_a_step_that_its_loop_allows():
    for name in shipped_rigs():
        tried = load_rig(name).tried_step(115.0)
        assert tried is None or tried.rpm >= 115.0
