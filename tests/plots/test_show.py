"""The page of a run: its motion is the run, its forces obey Newton, and it works in a browser."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn.measure.columns import heading, with_error
from trackdyn.plots.show import _page, geometry, show, signal, work_of
from trackdyn.simulation import replay as stretches
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.replay import replay
from trackdyn.simulation.simulate import simulate


@pytest.fixture(scope="module")
def recording(make_scene, rig):
    """More than two turns of the loop at speed: passages that are complete; the forces of every pitch."""
    return simulate(make_scene(210.0, duration=9.0, lead_in=1.0, pitches=tuple(range(1, rig.chain.pitches + 1))))


@pytest.fixture(scope="module")
def stretch(recording):
    return replay(recording)


@pytest.fixture(scope="module")
def page_file(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("shown")
    recording.save(folder / "run.npz")
    show(folder / "run.npz", folder / "run.html")
    return folder / "run.html"


@pytest.fixture
def open_page(open_file, page_file):
    return partial(open_file, page_file)


def test_an_impact_is_cut_and_leaves_the_other_arrows_their_length(recording, stretch):
    largest = [np.hypot(rows[:, 3], rows[:, 4]).max() for rows in stretch.contacts if len(rows)]
    usual, impact = geometry(recording, stretch), stretch.contacts[0].copy()
    assert 1.2 <= np.median(largest) / usual["force_bar"] <= 3
    impact[0, 3:5] = 1e6, 0.0
    hit = geometry(recording, replace(stretch, contacts=[impact, *stretch.contacts[1:]]))
    assert hit["force_bar"] == usual["force_bar"] and hit["force_most"] == 3 * usual["force_bar"]


def test_the_motion_is_that_of_the_run(recording, stretch):
    """Place and forces of the recorded pitch, which the record keeps by another way."""
    # equal steps in other chunks: rounding, which contact makes larger; a page draws 0.2 mm
    assert stretch.begin == recording.begin and stretch.apart[0] < 1e-9
    samples = np.rint(stretch.time * recording.rate).astype(int) - 1
    link = stretch.bodies[:, 0]
    half = recording.scene.rig.chain.link_length / 2
    middle = link[:, :2] + half * np.column_stack([np.cos(link[:, 2]), np.sin(link[:, 2])])
    assert np.abs(middle - recording.link_position[samples]).max() < 1e-9
    recorded, touches = recording.force[samples], np.stack([recording.area, recording.groove], axis=-1)[samples]
    drawn, touched = np.zeros_like(recorded), np.zeros((*recorded.shape, 2))
    for k, rows in enumerate(stretch.contacts):
        for side, _, _, u, v, area, groove, body, _ in rows[rows[:, 8] == 0]:
            contact = k, int(body) // 2, int(side)
            drawn[contact], touched[contact] = np.hypot(u, v), (area, groove)
    assert (drawn > 0).sum(axis=(0, 1))[[0, 2]].min() > 100
    assert drawn == pytest.approx(recorded, abs=1e-6 * recorded.max())
    arcs = drawn[:, :, :2] > 0  # an arc may touch without a force
    assert np.array_equal(touched[:, :, :2][arcs], touches[arcs])


@pytest.mark.parametrize("fields", [{"ring_radius": None}, {"chain": "single_pin"}])
def test_contacts_and_weight_accelerate_the_chain(make_scene, fields):
    """Both momenta change by the drawn forces at their drawn places; without friction nothing else acts."""
    scene = make_scene(210.0, friction="none", **fields)
    loop = Loop(scene.with_(rig=scene.rig.changed(tension__travel=0.2)))  # one pin a pitch makes a longer loop
    loop.advance(0.61)  # no contact begins in the step that follows, whose force would be of its end
    chain, h = loop.model.chain, loop.model.step
    centres, before = loop.mass_centres, loop.momentum
    contacts = stretches._contacts(loop)
    weight = -chain.mass * chain.gravity
    force = contacts[:, 3:5].sum(axis=0) + [0.0, weight.sum()]
    moment = (contacts[:, 1] * contacts[:, 4] - contacts[:, 2] * contacts[:, 3]).sum() + (centres[:, 0] * weight).sum()
    loop.step()
    # the velocities after the step are those of the places after it: arms have turned by h times the rate of the bodies
    size, angle = np.abs(contacts[:, 3:5]).sum(), h * np.abs(loop.state.rate).max()
    assert (loop.momentum - before) / h == pytest.approx([*force, moment], abs=angle * size)
    assert angle < 5e-3 and len(contacts) > 5


def test_a_steered_run_is_not_taken_for_the_recorded_one(recording):
    whole, steered = (
        show(run, seconds=0.05) for run in (recording, replace(recording, link_position=recording.link_position + 1e-3))
    )
    same, text = (" ".join(shown.text.split()) for shown in (whole, steered))
    assert "This is not the recorded run." in text and "by up to 0.001 m" in text
    assert "It is the recorded run" not in text and "It is the recorded run" in same
    shortened = replace(whole.stretch, apart=None)  # of a long lead-in
    assert "s after its start, not the record itself" in _page(recording, shortened, "run")


@pytest.mark.parametrize(("width", "scheme"), [(318, "light"), (1400, "dark")])  # a phone of 84 mm, at 96 dots an inch
def test_no_rule_of_accessibility_is_broken(open_page, broken_rules, width, scheme):
    assert broken_rules(open_page(width, 900, color_scheme=scheme)) == []


def test_the_loop_plays_pauses_and_scrubs_and_the_tension_follows(open_page, stretch):
    page, picture = open_page(), "document.getElementById('scene').toDataURL()"
    joints = "document.getElementById('tension-plot').data[2].y"
    page.select_option("#pace", "1")
    first, forces = page.evaluate(picture), page.evaluate(joints)
    page.click("#play")
    page.wait_for_function("Number(document.getElementById('scrub').value) > 20")
    page.click("#play")
    stopped = page.inner_text("#clock")
    page.wait_for_timeout(150)
    assert page.evaluate(picture) != first and page.inner_text("#clock") == stopped
    page.fill("#scrub", "30")
    assert page.inner_text("#clock") == f"{stretch.time[30]:.2f} s"
    order, now = np.argsort(stretch.along[30]), page.evaluate(joints)
    assert now == pytest.approx(stretch.tension[30][order], abs=0.51) and now != forces
    assert f"road wheel {(stretch.contacts[30][:, 0] == 4).sum()} (largest" in page.inner_text("#readout")
    assert re.search(r"The bar is \d+ N throughout", page.inner_text("#readout"))
    for name, value in (("view", "sprocket"), ("view", "follow"), ("colours", "tension")):
        before = page.evaluate(picture)
        page.select_option(f"#{name}", value)
        assert page.evaluate(picture) != before


def test_shares_of_work_are_no_contact_durations(recording):
    rows = work_of(recording)
    assert rows[0]["work_share_pct"] == pytest.approx(100.0, rel=1e-12)
    assert heading(list(rows[0])[-1]) == "share of the sprocket's work (%)"


def test_a_long_history_keeps_its_extremes(recording):
    mean, g = np.zeros((50_000, 1, 3)), recording.scene.rig.gravity
    mean[[1234, 40_321], 0, 1] = 5.0, -7.0
    whole = signal(replace(recording, mean=mean, time=np.arange(50_000) / recording.rate), None)["whole"]
    assert len(whole["low"]) == 2000
    assert [max(whole["high"]), min(whole["low"])] == pytest.approx([1 + 5 / g, 1 - 7 / g], rel=1e-3)


@pytest.mark.parametrize("seconds", [0.0, 61.0, float("nan"), "long"])
def test_a_stretch_out_of_range_is_refused(recording, seconds, tmp_path):
    refused(show, recording, tmp_path / "run.html", start="seconds ", seconds=seconds)
    assert not list(tmp_path.iterdir())


def test_a_value_is_shown_as_far_as_its_error_reaches_and_no_error_of_rounding():
    assert with_error(44.25108, 0.0013) == "44.2511 ± 0.0013"
    assert {with_error(44.25108, error) for error in (0.0, None, float("nan"), 1.1e-14)} == {"44.3"}
