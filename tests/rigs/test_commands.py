"""Commands about rigs."""

import warnings

import pytest

from tests.conftest import run_command, written
from trackdyn import check, load_rig


@pytest.mark.parametrize("name", ["bench", "m113", "paper", "robot", "vehicle"])
def test_a_new_file_is_the_rig_that_it_is_like(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run_command("new", "mine.yaml", "--like", name)
    assert done.code == 0, done.err
    its = load_rig(name)
    # but for drag of its wheels by laws that it does not have; and a copy was not tried
    wheels = {f"{wheel}." for wheel in its.wheels}
    its = its.changed(**{field: 0.0 for field in its.without_effect if any(map(field.startswith, wheels))})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_rig(tmp_path / "mine.yaml") == its


def test_an_inherited_groove_for_other_teeth_is_reported(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    larger = "sprocket: {source: x, teeth: 15, equal_pitch_radius: 0.354 m, ring_radius: 0.354 m}\n"
    for name, text, reported in (
        ("first", f"like: bench\nchain: {{source: x, pitches: 27}}\n{larger}", True),
        ("second", "like: first.yaml\n", True), ("fits", "like: bench\n", False),
    ):  # fmt: skip
        done = run_command("check", written(tmp_path / f"{name}.yaml", text).name, "--no-settle")
        assert done.code == 0, done.err
        assert "equal pitch  a ring of 0." in done.out and "m (chord)" in done.out
        assert ("the groove is that of " in done.out and "this rig has 15 teeth" in done.out) == reported


@pytest.mark.parametrize(("name", "changes", "words"), [
    ("bench", {}, []), ("bench", {"tension__pre_tension": 0.0}, ["sags by half or more"]),
    ("bench", {"tension__pre_tension": 1000.0}, ["the longest strand, 1.01 m, sags by 17% of its span"]),
    ("m113", {}, ["idler and road_5 overlap in the side view"]), ("vehicle", {}, ["the taut chain passes carrier by"]),
])  # fmt: skip
def test_unusual_properties_of_a_rig_are_named(name, changes, words):
    rig = load_rig(name)
    unusual = check(rig.changed(**changes) if changes else rig, settle=False).unusual
    assert all(word in text for word, text in zip(words, unusual, strict=True))
