"""Contact intervals, passages and their statistics on made-up logs with known answers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.conftest import contact_table, made_recording, refused
from trackdyn.measure.contacts import SHORT, passages, sampled_shares
from trackdyn.measure.estimators import meshing_summary
from trackdyn.measure.events import like_peaks, mean_events, passage_events, peaks, smoothed_maxima
from trackdyn.measure.metrics import needed_lengths, remarks, run_metrics
from trackdyn.model.arrays import CONTACT_INTERVAL
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene

RIG = load_rig("paper")
PITCHES, TEETH = RIG.chain.pitches, RIG.sprocket.teeth
TURN = 2.0  # of the sprocket, s
RPM = 60 * RIG.sprocket.transmission_ratio / TURN
LOOP = TURN * PITCHES / TEETH
BEGIN, STEP = 6.0, 1e-4
LEFT, RIGHT, RING = range(3)


def interval(pitch, side, start, end, force=100.0, groove=3, area=2, peak=None, peak_at=None):
    """A row of the log: constant ``force`` from ``start`` to ``end`` (s of the record), 1-based pitch."""
    peak, peak_at = peak or force, start if peak_at is None else peak_at
    groove, bits = (0, 0) if side == RING else (groove, 1 << (area - 1))
    times, length = np.array([start, end]) + BEGIN, end - start
    return [pitch - 1, side, groove, bits, *times, peak, peak_at + BEGIN, force * length, force**2 * length]


def recording(rows, seconds=20.0, ring_radius=0.308, rpm=RPM, area=None):
    samples = round(seconds * RIG.rate)
    area = np.zeros((samples, 1, 2), np.int8) if area is None else area
    rates = np.full((samples, 3), -2 * np.pi * rpm / RPM / TURN)
    log = np.array([tuple(row) for row in rows], CONTACT_INTERVAL)
    time = np.arange(samples) / RIG.rate
    made = {"time": time, "force": np.zeros((samples, 1, 3)), "wheel_rate": rates, "area": area, "contact_log": log}
    return made_recording(Scene(RIG, rpm, ring_radius, step=STEP), **made, begin=BEGIN)


def pressed(run, *forces):
    """The recording with these forces (N) of the left arc at these samples."""
    force = np.zeros_like(run.force)
    for samples, value in forces:
        force[samples, 0, LEFT] = value
    return replace(run, force=force)


def with_ring(start, connector=5, force=100.0):
    """Log of one passage: ring for half a turn, left arc from 0.9 to 1.1 of it, chattering at first."""
    return [
        interval(connector + 1, RING, start, start + 1.0, 10 * force, peak=15 * force, peak_at=start + 0.25),
        interval(connector, LEFT, start + 0.9, start + 0.910, force),
        interval(connector, LEFT, start + 0.912, start + 1.1, force, peak=2 * force, peak_at=start + 1.0),
    ]


def without_ring(start, connector=5):
    return [
        interval(connector, RIGHT, start, start + 0.8, area=7, peak=500.0, peak_at=start + 0.7),
        interval(connector, LEFT, start + 0.1, start + 0.85, peak=600.0, peak_at=start + 0.2),
    ]


def test_contacts_that_chatter_are_one_interval_but_the_pauses_do_not_count():
    """A contact that the beginning of the record cuts is none: that of pitch 9, not that of pitch 7."""
    cut = [interval(9, RING, STEP, 0.5), interval(7, RING, 3 * STEP, 0.5)]
    table = contact_table(recording(cut + with_ring(3.0))).set_index("pitch")
    assert table["side"].to_dict() == {7: "ring", 6: "ring", 5: "left"}
    names = ["start_s", "end_s", "touching_s", "share_pct", "impulse_ns", "square_n2s", "peak_n", "peak_s"]
    assert table.loc[5, names].tolist() == pytest.approx([3.9, 4.1, 0.198, 9.9, 19.8, 1980.0, 200.0, 4.0])


@pytest.mark.parametrize(("change", "gap", "count"), [
    ({"pitch": 6}, 0.001, 2), ({"side": RIGHT, "area": 7}, 0.001, 2), ({"groove": 4}, 0.001, 2),
    ({}, 0.99 * SHORT * TURN, 1), ({}, 1.01 * SHORT * TURN, 2),
])  # fmt: skip
def test_only_contacts_of_the_same_pitch_side_and_groove_are_merged_over_a_short_gap(change, gap, count):
    """The paper's 0.01 s of the turn of 2.906 s at 115 rpm, that is 6.88 ms of the turn of 2 s here."""
    assert abs(SHORT * TURN - 0.00688) < 1e-5
    second = {"pitch": 5, "side": LEFT, "start": 3.1 + gap, "end": 3.2 + gap} | change
    assert len(contact_table(recording([interval(5, LEFT, 3.0, 3.1), interval(**second)], ring_radius=None))) == count


@pytest.mark.parametrize("start", [1.0, 20.0 - 1.1 - 1.0])
def test_a_passage_near_an_end_of_the_record_does_not_count(start):
    run = recording(with_ring(start) + with_ring(7.0, connector=9))
    assert passages(run)["connector"].unique().tolist() == [9]
    cut = contact_table(run).query("connector == 5")
    assert (cut["passage"] == -1).all() and cut[["phase_start", "phase_end"]].isna().all(axis=None)


def test_summary_of_one_passage():
    area = np.zeros((20000, 1, 2), np.int8)
    area[3900:4100, 0, 0] = 2
    area[4000, 0, 0] = 3
    summary = meshing_summary(recording(with_ring(3.0), area=area))
    expected = {
        "passages": 1, "left_share_pct": 9.9, "ring_share_pct": 50.0, "left_phase_start": 0.45, "left_phase_end": 0.55,
        "left_rms_n": (100.0**2 * 0.198 / LOOP) ** 0.5, "ring_sd_n": 1000.0 * (1 / LOOP - 1 / LOOP**2) ** 0.5,
        "left_rms_contact_n": 100.0, "ring_rms_contact_n": 1000.0, "ring_peak_n": 1500.0, "right_share_pct": 0.0,
        "right_rms_n": 0.0, "right_sd_n": 0.0, "right_rms_contact_n": 0.0, "right_peak_n": 0.0,
        "right_phase_start": np.nan, "left_share_error_pct": np.nan,
    }  # fmt: skip
    assert {name: summary[name] for name in expected} == pytest.approx(expected, nan_ok=True)
    assert (summary["left_areas"], summary["right_areas"]) == ("2", "none")


def test_standard_errors_over_passages():
    times = np.array([0.22, 0.24, 0.26])
    rows = [interval(k + 1, LEFT, 3.1 + 0.1 * k, 3.1 + 0.1 * k + time) for k, time in enumerate(times)]
    summary = meshing_summary(recording(rows, ring_radius=None))
    share, square = 100 * times / TURN, 100.0**2 * times / LOOP
    assert summary["left_share_pct"] == pytest.approx(share.mean())
    assert summary["left_share_error_pct"] == pytest.approx(share.std(ddof=1) / 3**0.5)
    assert summary["left_rms_error_n"] == pytest.approx(square.std(ddof=1) / 3**0.5 / (2 * square.mean() ** 0.5))
    assert summary["left_sd_error_n"] > 0
    assert summary["right_rms_error_n"] == summary["right_sd_error_n"] == summary["right_share_error_pct"] == 0


@pytest.mark.parametrize("run", [
    {"rows": [], "ring_radius": None}, {"rows": [], "seconds": 0.001}, {"rows": with_ring(0.1), "seconds": 1.5},
    {"rows": with_ring(3.0) + without_ring(9.0), "rpm": 0.0},
], ids=["no contact", "one sample", "shorter than a passage", "at rest with contacts"])  # fmt: skip
def test_nothing_to_measure_gives_nan(run):
    run = recording(**run)
    summary, events = meshing_summary(run), mean_events(run)
    assert summary.pop("passages") == 0 and summary.pop("left_areas") == summary.pop("right_areas") == ""
    assert np.isnan(list(summary.values())).all() and passages(run).empty
    assert len(contact_table(run)) <= len(run.contact_log)
    assert events["mean_s"].isna().all() and (events["passages"] == 0).all()


@pytest.mark.parametrize("length", [0.00065, 0.99 * SHORT * TURN, 1.01 * SHORT * TURN])
def test_an_impact_that_rebounds_counts_in_the_largest_force_but_not_in_the_printed_times(length):
    """Of 7 kN, before and after the contact of an arc: it has times of its own only from `SHORT` on."""
    taps = [
        interval(5, LEFT, at, at + length, force=7000.0, groove=groove, peak_at=at + 1e-4)
        for at, groove in ((2.97, 4), (4.13, 5))
    ]
    plain, tapped = recording(with_ring(3.0)), recording(with_ring(3.0) + taps)
    before, after = (passages(run).set_index("side") for run in (plain, tapped))
    names, short = ["start_s", "end_s", "phase_start", "phase_end", "peak_s"], length < SHORT * TURN
    assert passage_events(tapped).equals(passage_events(plain)) == short
    assert after[names].equals(before[names]) == after.loc["ring"].equals(before.loc["ring"]) == short
    assert after.loc["left", "peak_n"] == 7000.0 and after.loc["left", "highest_s"] == pytest.approx(2.9701)
    assert after.loc["left", "touching_s"] == pytest.approx(before.loc["left", "touching_s"] + 2 * length)
    summary = meshing_summary(tapped)
    assert summary["left_peak_n"] == summary["left_peak_largest_n"] == 7000.0
    assert peaks(tapped, "left")["peak_n"].tolist() == [7000.0]  # the planner's


@pytest.mark.parametrize(("at", "force", "counted"), [(19.7, 300.0, [600.0, 20.0]), (19.9, 0.0, [600.0])])
def test_an_impact_whose_contact_lasts_at_the_end_of_the_record_is_no_peak(at, force, counted):
    """The contact that carries the load is not logged then, or flies; the impact of 20 N before it was."""
    rows = [interval(5, LEFT, 3.0, 4.0, peak=600.0), interval(5, LEFT, at, at + 5e-4, peak=20.0)]
    run = replace(recording(rows, ring_radius=None), pitches=np.array([5]))
    assert peaks(run, "left")["peak_n"].tolist() == counted
    assert peaks(pressed(run, (-1, force)), "left")["peak_n"].tolist() == [600.0]


def test_a_maximum_after_the_touch_is_not_the_spike_of_the_touch():
    """A touch of 900 N for a millisecond, 300 N for another later, 150 N for 50 ms at the end of 100 N for 0.2 s."""
    run = recording([interval(1, LEFT, 3.0, 3.2)], ring_radius=None)
    run = pressed(run, (slice(3000, 3201), 100.0), (slice(3150, 3201), 150.0), (3001, 900.0), (3060, 300.0))
    table = smoothed_maxima(run).set_index("event")["mean_s"]
    assert table["left maximum, after the touch"] == pytest.approx(0.060)
    # the mean over 0.01 s of the spike, (900 + 9 * 100) / 10 N, is above 150 N as well
    assert table["left maximum, mean over 0.01 s"] == pytest.approx(0.001, abs=0.01)


def test_peaks_of_like_height_are_those_half_a_pitch_apart_and_nearly_as_high_as_the_largest():
    """Four plateaus of 0.04 s, 0.2 s apart, of 100, 84, 90 and 86 N, and one of 99 N close behind the first."""
    run = recording([interval(1, LEFT, 3.0, 4.0)], ring_radius=None)
    plateaus = ((3100, 100.0), (3300, 84.0), (3500, 90.0), (3700, 86.0), (3160, 99.0))
    table = like_peaks(pressed(run, *((slice(at, at + 41), height) for at, height in plateaus)))
    assert table["event"].tolist() == [f"left maximum, peak {k} of like height" for k in (1, 2, 3)]
    assert table["median_s"].tolist() == pytest.approx([0.12, 0.52, 0.72], abs=0.011)
    assert like_peaks(recording([], ring_radius=None)).empty


# pitch, side, start and length (s), groove
ANY_CONTACT = st.tuples(
    st.integers(1, PITCHES), st.integers(0, 2), st.floats(0.01, 18.0), st.floats(1e-4, 1.0), st.integers(1, 13)
)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(ANY_CONTACT, max_size=25))
def test_any_log_is_conserved_by_merging(contacts):
    run = recording([interval(p, side, start, start + length, groove=g) for p, side, start, length, g in contacts])
    table, log = contact_table(run), run.contact_log
    assert table["impulse_ns"].sum() == pytest.approx(log["impulse_ns"].sum())
    assert table["touching_s"].sum() == pytest.approx((log["end_s"] - log["start_s"]).sum())
    assert table["peak_n"].max() == log["peak_n"].max() if len(log) else table.empty
    whole = table[(table["end_s"] - table["start_s"] >= SHORT * TURN) & (table["passage"] >= 0)]
    assert (whole["phase_start"] >= 0).all()
    assert whole.groupby("passage")["phase_start"].min().eq(0).all()
    meshing_summary(run)


def test_the_link_ahead_belongs_to_the_passage_around_the_end_of_the_loop():
    table = contact_table(recording([interval(1, RING, 3.0, 4.0), interval(PITCHES, LEFT, 3.9, 4.1)]))
    assert table[["connector", "passage"]].to_numpy().tolist() == [[PITCHES, 0], [PITCHES, 0]]


def test_mean_events_and_their_scatter():
    second = with_ring(3.5, connector=9)
    second[2] = interval(9, LEFT, 4.412, 4.64, peak=900.0, peak_at=4.6)
    table = mean_events(recording(with_ring(3.0) + with_ring(3.0 + LOOP)[:1] + second)).set_index("event")
    order = ["ring touched", "ring maximum", "left touches", "left maximum", "ring left", "out"]
    assert list(table.index) == order and table["passages"].tolist() == [3, 3, 2, 2, 3, 2]
    means = [0.0, 0.25, (0.9 + 0.9) / 2, (1.0 + 1.1) / 2, 1.0, (1.1 + 1.14) / 2]
    assert table["mean_s"].tolist() == pytest.approx(means)
    assert table.loc[["ring left", "out"], "sd_s"].tolist() == pytest.approx([0.0, 0.04 / 2**0.5])


def test_phases_count_from_the_first_contact_and_passages_without_one_in_shares_only():
    bare = contact_table(recording(without_ring(3.0), ring_radius=None)).set_index("side")["phase_start"]
    assert bare["right"] == 0 and bare["left"] == pytest.approx(0.05)
    summary = meshing_summary(recording(with_ring(3.0) + with_ring(3.5, connector=9)[:1]))
    assert (summary["left_share_pct"], summary["left_phase_start"]) == pytest.approx((9.9 / 2, 0.45))


def test_shares_of_samples_are_those_of_all_pitches():
    """Of 35 pitches two are in area 2 at every instant: of 13 teeth 2/13 of a turn."""
    area = np.zeros((40, PITCHES), np.int8)
    area[:, [3, 20]] = 2
    shares = sampled_shares(area, RIG)
    assert shares[2] == pytest.approx(100 * 2 / TEETH) and shares[3:].sum() == 0.0


def test_a_record_at_changing_speed_is_not_measured():
    run = recording(with_ring(3.0))
    assert run.periods == run.scene.periods and np.isfinite(meshing_summary(run)["left_share_pct"])
    rates = run.wheel_rate.copy()
    rates[:1000] *= 0.5
    slower = replace(run, wheel_rate=rates)
    rounded = replace(run, wheel_rate=np.r_[run.wheel_rate[:1] * 0.9995, run.wheel_rate[1:]])
    assert rounded.periods == run.periods  # a ramp ends within half a step
    for measure in (meshing_summary, passages, needed_lengths, lambda run: run_metrics("run", run)):
        refused(measure, slower, words=["the motor speed goes from 83.55 to 167.1 rev/min ", "the ramp"])


def test_a_loop_at_rest_has_no_shares_and_nothing_that_fails():
    still = recording([], 3.0, rpm=0.0)
    row = run_metrics("rest", still)
    assert row["passages"] == 0 and np.isnan(row["left_share_pct"]) and np.isnan(row["line_hz"])
    assert remarks(still) == [] and needed_lengths(still) == {}
