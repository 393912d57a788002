"""The ring study of any rig: which radii, which one to choose and by which rule, and what the command writes."""

import pandas as pd
import pytest

from tests.conftest import run_command
from trackdyn.inputs.errors import InputError
from trackdyn.measure.metrics import whole_errors
from trackdyn.measure.ring_rule import SPAN, RingRule, advice, compared
from trackdyn.measure.stopping import run_steady
from trackdyn.measure.taken import meshing_summary
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene import rings
from trackdyn.scene.rings import study_radii, usual_rings
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settling import SettledLoops
from trackdyn.sweeps.ring import ring_study

TEETH = 13  # 7.7 % of a turn, and 9.7 % with two points
RADII = (0.304, 0.305, 0.306, 0.307, 0.308)
LEFT = {115.0: (20.0, 12.0, 9.6, 9.0, 8.5), 210.0: (21.0, 9.0, 8.9, 8.8, 8.6)}
RIGHT = {115.0: (3.0, 0.0, 0.0, 0.0, 0.0), 210.0: (5.0, 0.6, 0.4, 0.0, 0.0)}


def study(left=LEFT, right=RIGHT):
    rows = [
        {
            "rpm": rpm, "ring_radius_m": radius, "left_share_pct": left[rpm][k], "left_share_error_pct": 0.1,
            "right_share_pct": right[rpm][k], "right_share_error_pct": 0.1, "left_rms_n": 100.0 * k, "ring_rms_n": 9.0,
            "settled_tension_n": 3000.0 + k, "teeth_sliding_j": 20.0 - k, "ring_sliding_j": 1.5 * k,
        }
        for rpm in LEFT for k, radius in enumerate(RADII)
    ]  # fmt: skip
    bare = {"rpm": 115.0, "ring_radius_m": float("nan"), "left_share_pct": 1.0, "teeth_sliding_j": 70.0}
    return pd.DataFrame([bare, *rows])


RULE = RingRule(TEETH)


def test_the_smallest_ring_that_keeps_every_bound_at_every_speed_is_chosen():
    """At 210 rpm 0.305 m misses the right arc's bound, at 115 rpm that of the left one."""
    rule = RULE
    assert rule.radius(study()) == 0.306 and str(rule) == "right_share_pct < 0.5, left_share_pct <= tooth + 2, smallest"
    rings = study().dropna(subset="ring_radius_m")
    rows = [bound.missed(rings)[["ring_radius_m", "rpm"]].to_numpy().tolist() for bound in rule.bounds]
    assert rows == [[[0.304, 115.0], [0.304, 210.0], [0.305, 210.0]], [[0.304, 115.0], [0.305, 115.0], [0.304, 210.0]]]
    assert rule.band(study()) == {1.0: 0.308, 3.0: 0.306}
    said = advice(study(), rule)
    assert said[:3] == [
        "recommended: a ring of radius 0.306 m",
        "the rule holds from 0.3055 to 0.308 m, ends known to 0.5 mm",
        "with another margin instead of 2 points the rule recommends 0.308 m with 1, 0.306 m with 3",
    ]
    assert "at 210 rpm is 0.60 +- 0.10, must be < 0.5; " in said[3] and said[4].endswith("keeps every bound, too")
    rings = compared(study(), rule)
    assert set(rings["ring"]) == {"none", "smaller", "recommended", "larger"}
    assert rings.set_index("ring").loc["none", "teeth_sliding_j"].max() == 70
    assert not any("_pct" in sentence for sentence in said)


def test_a_choice_at_the_end_of_the_study_is_said_first():
    said = advice(study({115.0: (20.0, 12.0, 11.0, 10.0, 8.5), 210.0: LEFT[210.0]}), RULE)
    assert said[0].startswith("the recommended radius is the largest of the study, 0.308 m")
    assert said[1] == "recommended: a ring of radius 0.308 m"


def test_a_radius_that_serves_alone_is_not_chosen():
    """A dip of one step, 0.3 mm wide, moves with the grid."""
    near = study({115.0: (20.0, 9.0, 12.0, 9.0, 8.5), 210.0: LEFT[210.0]}, RIGHT | {210.0: (5.0, 0.0, 0.0, 0.0, 0.0)})
    assert RULE.radius(near) == 0.307
    assert "a slightly larger one does not" not in str(advice(near, RULE))
    lonely = near[near["ring_radius_m"].isin([0.304, 0.305, 0.306])]
    assert advice(lonely, RULE)[0] == (
        "no radius of these serves at every speed: 0.305 m keep every bound, but not all radii up to 0.3% above them"
    )
    wide = near.assign(ring_radius_m=0.3 + 4 * (near["ring_radius_m"] - 0.3))
    assert RULE.radius(wide) == pytest.approx(0.32)


def curve(radius, rpm):
    """Left and right arcs that let go near 0.306 m, with a second window of 0.4 mm below it."""
    left = 9.0 if 0.3041 <= radius <= 0.3045 or radius >= 0.30613 + 1e-6 * rpm else 11.0
    return {"left_share_pct": left, "right_share_pct": 0.0}


def made_up_study(monkeypatch, radii, of=curve):
    """A study of the rig bench whose runs are a curve, and the lists of radii that were run."""
    run = []

    def table(scenes, *_):
        rows = [
            {"rpm": scene.motor_rpm, "ring_radius_m": float("nan"), "state": "done"}
            if scene.ring_radius is None
            else {
                "rpm": scene.motor_rpm, "ring_radius_m": scene.ring_radius, "state": "done",
                "settled_tension_n": 3000.0, "teeth_sliding_j": 1.0, "ring_sliding_j": 1.0, "left_rms_n": 1.0,
                "ring_rms_n": 1.0, **of(scene.ring_radius, scene.motor_rpm),
            }
            for scene in scenes
        ]  # fmt: skip
        run.append(sorted({scene.ring_radius for scene in scenes} - {None}))
        return pd.DataFrame(rows)

    monkeypatch.setattr("trackdyn.sweeps.ring._study", table)
    return ring_study(load_rig("bench"), [115.0, 210.0], radii, rule=RULE), run


GRIDS = [[0.3000 + k * 0.0016 + first for k in range(8)] for first in (0.0, 0.0005, 0.0011)]


def test_three_grids_name_windows_that_overlap(monkeypatch):
    """A study looks between the last radius that misses and the first that serves, and a millimetre above that."""
    ends, chosen = [], []
    for grid in GRIDS:
        made, run = made_up_study(monkeypatch, grid)
        window, radius = RULE.window(made), RULE.radius(made)
        chosen.append(radius)
        ends.append(window.ends)
        assert len(run[-1]) - len(grid) <= 6 and made["added"].sum() == 2 * (len(run[-1]) - len(grid))
        assert any(radius < other <= radius * (1 + SPAN) for other in run[-1])
        assert "narrower" not in str(window) and window.first - window.below <= 5e-4
    assert max(low for low, _ in ends) < min(high for _, high in ends)
    assert min(chosen) > 0.3061 and max(chosen) - min(chosen) <= 5e-4


def test_a_narrow_window_is_said_and_not_chosen(monkeypatch):
    """The bounds hold over 0.4 mm alone, which is looked for around any radius that keeps them."""

    def dip(radius, rpm):
        return {"left_share_pct": 9.0 if 0.3041 <= radius <= 0.3045 else 11.0, "right_share_pct": 0.0}

    made, _ = made_up_study(monkeypatch, [0.3030, 0.3043, 0.3060, 0.3070], dip)
    said = advice(made, RULE)
    assert said[0].startswith("no radius of these serves at every speed: 0.3043")
    assert "narrower than 0.5 mm, which a ring as made may miss" in said[1], said
    low, high = RULE.window(made).ends
    assert low < 0.3043 < high and high - low < 5e-4


def test_what_is_not_known_does_not_serve_and_less_margin_may_leave_none():
    unknown = LEFT | {210.0: (21.0, 9.0, float("nan"), 8.8, 8.7)}
    assert RULE.radius(study(unknown)) == 0.307
    none = RULE._replace(margin=0.5)
    assert pd.isna(none.radius(study())) and list(RULE.band(study(LEFT | {115.0: (20.0,) * 5}))) == [1.0, 3.0]
    assert advice(study(), none)[:2] == [
        "no radius of these serves at every speed",
        "right arc, contact duration (% of a turn) < 0.5, at every speed: 0.306, 0.307, 0.308 m",
    ]


@pytest.mark.parametrize("name", shipped_rigs())
def test_the_radii_of_a_study_lie_where_a_scene_allows_them(name):
    rig = load_rig(name)
    radii = study_radii(rig)
    assert len(radii) == 11 and radii == sorted(radii)
    assert usual_rings(rig)[0] <= rig.sprocket.equal_pitch_radius < radii[-1]
    for radius in (radii[0], radii[-1], *rig.equal_pitch_radii.values()):
        Scene(rig, 115.0, radius)


def test_a_ring_that_bears_nothing_is_not_where_tightening_begins():
    """A chain worn by 3.5 %, whose least ring is larger than the rig's own: tightening counts from there."""
    rig = load_rig("bench")
    worn = rig.changed(sprocket__equal_pitch_radius=0.314)
    radii, least = study_radii(worn), usual_rings(worn)[0]
    assert len(radii) == 11 and least > rig.ring_radius
    assert radii == pytest.approx(study_radii(worn.changed(sprocket__ring_radius=least)), abs=1e-4)


def test_a_narrow_range_has_all_radii_inside_it(monkeypatch):
    """A least ring between two hundredths of a millimetre is not rounded out of what a scene allows."""
    rig = load_rig("robot")
    monkeypatch.setattr(rings, "usual_rings", lambda rig: (0.0802832, 0.0804149))
    radii = study_radii(rig)
    assert len(set(radii)) == 11 and 0.0802832 <= radii[0] < radii[-1] <= 0.0804149


def test_a_tensioner_without_room_for_a_ring_is_named():
    rig = load_rig("bench").changed(sprocket__equal_pitch_radius=0.318, tension__travel=0.005)
    with pytest.raises(InputError, match=r"the least ring that carries the chain has 0\.3.*tension\.travel = "):
        study_radii(rig)


def test_the_least_ring_bears_the_chain_and_the_largest_tightens_it_as_said():
    """Against loops that were settled: half a millimetre below the least one nothing lies on the ring, above it a link
    or more does, with its weight of 100 N and the pull of the strands.
    """
    rig, starts = load_rig("bench"), SettledLoops()
    least, largest = usual_rings(rig)
    load, tension = {}, {}
    for radius in (least - 5e-4, least + 5e-4, largest):
        loop = Loop(Scene(rig, 115.0, radius), starts)
        load[radius], tension[radius] = loop.work.wheel_force[:, 0].sum(), loop.layout.settled_tension_n
    below, above, _ = load.values()
    assert below == 0.0 and above > 100.0
    assert 3 < tension[largest] / rig.tension.pre_tension < 7


@pytest.mark.slow
def test_the_command_writes_its_files_and_goes_on_with_the_same_numbers(tmp_path, monkeypatch):
    """One scene against the recording that the pipeline makes of it; a second call computes no row again."""
    monkeypatch.chdir(tmp_path)
    line = ["ring", "bench", "--rpm", "210", "--radii", "0.307", "--out", "mine", "-j1"]
    done = run_command(*line)
    assert done.code == 0 and "look at mine/ring.html" in done.out
    table = pd.read_csv("mine/ring.csv")
    assert table["ring_radius_m"].fillna(0).tolist() == [0.0, 0.307] and set(table["state"]) == {"done"}
    rig = load_rig("bench")
    rule = StopRule()
    recording, known = run_steady(Scene(rig, 210.0, 0.307, **steady_fields(rig, 210.0, rule)), rule)
    summary, row = meshing_summary(recording), table.iloc[1]
    for name in ("left_share_pct", "ring_rms_n", "right_share_pct"):
        assert row[name] == pytest.approx(summary[name], rel=1e-8), name
    error = whole_errors(recording.scene)("left_share_pct", summary["left_share_pct"], summary["left_share_error_pct"])
    assert row["left_share_error_pct"] == pytest.approx(error, rel=1e-8)
    assert row["contacts_converged"] == known
    names = {f"{name}.{end}" for name in ("fig23_a", "fig23_b", "fig24", "sliding") for end in ("png", "svg")}
    assert names | {"ring.csv", "ring.html", "rows"} == {path.name for path in (tmp_path / "mine").iterdir()}
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}
    done = run_command(*line)
    assert done.code == 0 and "recommended: a ring of radius 0.307 m" in done.out
    assert stamps == {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}
