"""The ring study of any rig: which radii, which one to choose and by which rule, and what the command writes."""

import pandas as pd
import pytest

from tests.conftest import run_command
from trackdyn.errors import InputError
from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.ring_rule import RULE, advice, parse_rule
from trackdyn.measure.stopping import run_steady
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.scene.rings import study_radii, usual_rings
from trackdyn.scene.scene import Scene, steady_fields
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settling import SettledLoops
from trackdyn.sweeps.ring import contact_stop_rule

RADII = (0.304, 0.305, 0.306, 0.307, 0.308)
LEFT = {115.0: (20.0, 12.0, 10.4, 9.0, 8.5), 210.0: (21.0, 9.9, 9.0, 8.8, 8.7)}
RIGHT = {115.0: (3.0, 0.0, 0.0, 0.0, 0.0), 210.0: (5.0, 0.6, 0.4, 0.0, 0.0)}


def study(left=LEFT, right=RIGHT):
    rows = [
        {
            "rpm": rpm, "ring_radius_m": radius, "left_share_pct": left[rpm][k], "left_share_error_pct": 0.1,
            "right_share_pct": right[rpm][k], "right_share_error_pct": 0.1, "left_rms_n": 100.0 * k, "ring_rms_n": 9.0,
        }
        for rpm in LEFT for k, radius in enumerate(RADII)
    ]  # fmt: skip
    return pd.DataFrame([{"rpm": 115.0, "ring_radius_m": float("nan"), "left_share_pct": 1.0}, *rows])


def test_the_smallest_ring_that_keeps_every_bound_at_every_speed_is_chosen():
    """At 210 rpm alone 0.305 m misses the right arc's bound, at 115 rpm also that of the left one (least 8.5 %)."""
    rule = parse_rule(RULE)
    assert rule.radius(study()) == 0.306 and parse_rule(str(rule)) == rule
    rings = study().dropna(subset="ring_radius_m")
    rows = [bound.missed(rings)[["ring_radius_m", "rpm"]].to_numpy().tolist() for bound in rule.bounds]
    assert rows == [[[0.304, 115.0], [0.304, 210.0], [0.305, 210.0]], [[0.304, 115.0], [0.305, 115.0], [0.304, 210.0]]]
    said = advice(study(), rule)
    assert said[0].startswith("choose 0.306 m, by the rule right_share_pct < 0.5")
    assert "at 210 rpm is 0.6 +- 0.1, must be < 0.5; " in said[1] and "serves, too" in said[2]
    assert said[-1] == "at one speed alone: 115 rpm 0.306 m, 210 rpm 0.306 m"


def test_what_is_not_known_does_not_serve_and_another_rule_chooses_otherwise():
    unknown = LEFT | {210.0: (21.0, 9.9, float("nan"), 8.8, 8.7)}
    assert parse_rule(RULE).radius(study(unknown)) == 0.307
    assert parse_rule("left_share_pct<=least+2,largest").radius(study()) == 0.308
    assert parse_rule("right_share_pct < 1, left_share_pct < 11, least left_rms_n").radius(study()) == 0.306
    none = parse_rule("left_share_pct < 8.6, smallest")
    assert pd.isna(none.radius(study()))
    assert advice(study(), none)[:2] == [
        "no radius of these serves at every speed", "left_share_pct < 8.6 at every speed: no radius",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("left_share_pct <= 2", "is no choice; end with smallest, largest or least COLUMN"),
        ("left <= 2, smallest", "'left' is no column that a rule can bound: rms_g, sd_g, or left_, right_ or ring_"),
        ("left_share_pct <= nan, smallest", "is no bound; expected a column"),
        ("left_rms_n", "is no choice"),
    ],
)
def test_a_rule_that_cannot_be_read_is_refused(text, says):
    with pytest.raises(InputError) as caught:
        parse_rule(text)
    assert says in str(caught.value)


@pytest.mark.parametrize("name", shipped_rigs())
def test_the_radii_of_a_study_lie_where_a_scene_allows_them(name):
    rig = load_rig(name)
    radii = study_radii(rig)
    assert len(radii) == 11 and radii == sorted(radii)
    assert usual_rings(rig)[0] <= rig.sprocket.equal_pitch_radius < radii[-1]
    for radius in (radii[0], radii[-1], *rig.equal_pitch_radii.values()):
        Scene(rig, 115.0, radius)


def test_the_least_ring_bears_the_chain_and_the_largest_tightens_it_as_said():
    """Against loops that were settled: half a millimetre below the least one nothing lies on the ring."""
    rig, starts = load_rig("bench"), SettledLoops()
    least, largest = usual_rings(rig)
    load, tension = {}, {}
    for radius in (least - 5e-4, least + 1.5e-3, largest):
        loop = Loop(Scene(rig, 115.0, radius), starts)
        load[radius], tension[radius] = loop.wheel_forces[:, 0].sum(), loop.layout["settled_tension_n"]
    below, above, _ = load.values()
    assert below == 0.0 and above > rig.tension.pre_tension
    assert 3 < tension[largest] / rig.tension.pre_tension < 7


@pytest.mark.slow
def test_the_command_writes_its_files_and_goes_on_with_the_same_numbers(tmp_path, monkeypatch):
    """One scene against the recording that the pipeline makes of it; a second call computes no row again."""
    monkeypatch.chdir(tmp_path)
    line = ["ring", "bench", "--rpm", "210", "--radii", "0.307", "--out", "mine", "-j1"]
    done = run_command(*line)
    assert done.code == 0 and "210 rpm: contact, % of a turn" in done.out and "look at mine/ring.html" in done.out
    table = pd.read_csv("mine/ring.csv")
    assert table["ring_radius_m"].fillna(0).tolist() == [0.0, 0.307] and set(table["state"]) == {"done"}
    rig = load_rig("bench")
    rule = contact_stop_rule(rig)
    recording, known = run_steady(Loop(Scene(rig, 210.0, 0.307, **steady_fields(rig, 210.0, rule))), rule)
    summary, row = meshing_summary(recording), table.iloc[1]
    for name in ("left_share_pct", "left_share_error_pct", "ring_rms_n", "right_share_pct"):
        assert row[name] == pytest.approx(summary[name], rel=1e-8), name
    assert row["contacts_converged"] == known
    names = {f"{name}.{end}" for name in ("fig23_a", "fig23_b", "fig24") for end in ("png", "svg")}
    assert names | {"ring.csv", "ring.html", "rows"} == {path.name for path in (tmp_path / "mine").iterdir()}
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}
    done = run_command(*line, "--rule", "smallest")
    assert done.code == 0 and "choose 0.307 m, by the rule smallest" in done.out
    assert stamps == {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--rpm 115,x", "--rpm = 'x': must be finite numbers"),
        ("--rpm 210 --radii 0.305,0.5", "ring_radius = 0.5: must be between"),
        ("--rpm 210 --radii 0.305:0.307", "--radii = '0.305:0.307': must be low:high:count"),
        ("--rpm 210 --radii 0.307:0.305:3", "must be low:high:count"),
        ("--rpm 210 --rule best", "--rule: 'best' is no choice"),
        ("--rpm 0", "motor_rpm = 0"),
    ],
)
def test_what_a_study_cannot_run_is_refused_before_it_runs(tmp_path, monkeypatch, options, says):
    monkeypatch.chdir(tmp_path)
    done = run_command("ring", "bench", *options.split())
    assert done.code == 1 and says in done.err and "\n" not in done.err.strip() and not list(tmp_path.iterdir())
