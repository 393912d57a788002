"""Ring study of any rig: its radii, the choice and its reasons, the files of the command."""

import operator
from itertools import pairwise

import pandas as pd
import pytest

from tests.conftest import refused, run_command
from trackdyn.inputs.errors import TrackdynError
from trackdyn.measure import ring_rule
from trackdyn.measure.estimators import meshing_summary
from trackdyn.measure.metrics import total_errors
from trackdyn.measure.ring_rule import SPAN, DurationRule, RingRule, advice, compared, windows, with_tooth_forces
from trackdyn.measure.stopping import run_steady
from trackdyn.plots.ring_study import force_figure
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene import rings
from trackdyn.scene.rings import least_ring, study_radii, usual_rings
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settling import SettledLoops
from trackdyn.sweeps.ring import ring_study

RADII = (0.304, 0.305, 0.306, 0.307, 0.308)
# forces of a tooth (N) by speed; without a ring 8000 and 6000 N
BARE = {115.0: 8000.0, 210.0: 6000.0}
FORCE = {115.0: (7900.0, 4500.0, 3900.0, 2000.0, 1800.0), 210.0: (6500.0, 2000.0, 2500.0, 1500.0, 1700.0)}
RULE, DURATIONS = RingRule(), DurationRule(13)  # 7.7 % of a turn, and 9.7 % with two points
BENCH = load_rig("bench")
CHAIN_SPEED = {rpm: BENCH.pitch / Scene(BENCH, rpm).periods.passage for rpm in BARE}  # m/s


def study(force=FORCE, error=0.0, **columns):
    """A study with forces on the left arc, smaller ones on the right one, and the same columns in all rows."""
    rows = [
        {
            "rpm": rpm, "ring_radius_m": radius, "left_peak_n": forces[k], "left_peak_error_n": error,
            "right_peak_n": 0.5 * forces[k], "right_peak_error_n": error, "left_rms_n": 100.0, "right_rms_n": 50.0,
            "left_share_pct": (20.0, 9.0, 9.0, 9.0, 9.0)[k], "right_share_pct": (3.0, 0.0, 0.0, 0.0, 0.6)[k],
            "settled_tension_n": 4000.0 + 100 * k, "teeth_sliding_j": 20.0 - k, "ring_sliding_j": 1.5 * k,
            "motor_power_w": 300.0 + k, "ring_rms_n": 9.0, "ring_peak_n": 3000.0,
        }
        for rpm, forces in force.items() for k, radius in enumerate(RADII)
    ]  # fmt: skip
    # without a ring it is the right arc that has more
    same = {"right_peak_error_n": 0.0, "settled_tension_n": 4000.0, "ring_sliding_j": 0.0, "motor_power_w": 280.0}
    same |= {"left_peak_n": 100.0, "teeth_sliding_j": 70.0}
    bare = [{"rpm": rpm, "right_peak_n": BARE[rpm]} | same for rpm in force]
    return pd.DataFrame([*bare, *rows]).assign(**columns)


def with_force(rpm, radius, force):
    return FORCE | {rpm: tuple(force if at == radius else old for at, old in zip(RADII, FORCE[rpm], strict=True))}


def without(table, radius, rpm=210.0, load=None):
    """The study without a ring (``None``: without the run of none) at a speed, under one of its loads."""
    gone = table["ring_radius_m"].isna() if radius is None else table["ring_radius_m"] == radius
    return table[~(gone & (table["rpm"] == rpm) & (table["load_n"] == load if load is not None else True))]


def test_the_smallest_ring_with_half_the_force_of_a_tooth_is_chosen():
    """At 115 rpm 0.305 m has 4500 of 8000 N; the larger of both arcs counts, at each speed against its own."""
    assert RULE.radius(study()) == 0.306
    assert list(RULE.kept(study()).values()) == [False, False, True, True, True]
    assert [RULE.radius(study(with_force(210.0, 0.306, force))) for force in (3000.0, 3000.1)] == [0.306, 0.307]
    assert RULE.radius(study().rename(columns={"left_peak_n": "right_peak_n", "right_peak_n": "left_peak_n"})) == 0.306
    assert RULE.band(study()) == {0.3: 0.307, 0.7: 0.305}
    assert RingRule(1.0).radius(study()) == 0.305  # at 210 rpm 0.304 m has more than without a ring
    row = with_tooth_forces(study(error=80.0)).set_index(["rpm", "ring_radius_m"]).loc[(115.0, 0.306)]
    assert row["tooth_ratio"] == 3900 / 8000 and row["tooth_ratio_error"] == pytest.approx(80 / 8000)
    assert row["tension_ratio"] == pytest.approx(4200 / 4000) and row["tooth_rms_n"] == 100.0


def test_a_ring_as_made_may_be_larger_and_must_halve_the_force_too():
    """Within 1.02 mm above 0.306 m lies 0.307 m: at 210 rpm it may have 3000 N, half of its own without a ring."""
    for force, radius in ((3000.0, 0.306), (3000.1, 0.308)):
        assert RULE.radius(study(with_force(210.0, 0.307, force))) == radius
    lonely = study({rpm: (*forces[:2], 2000.0, 9000.0, 9000.0) for rpm, forces in FORCE.items()})
    assert pd.isna(RULE.radius(lonely))
    assert advice(lonely, RULE, DURATIONS)[0] == (
        "no ring of these serves: 0.306 m keep the force of a tooth at 0.5 of that without a ring at every speed, but "
        "not a ring up to 0.3% larger: at 0.307 m a tooth bears 1.50 of that without a ring at 210 rpm"
    )
    wide = lonely.assign(ring_radius_m=0.3 + 4 * (lonely["ring_radius_m"] - 0.3))  # 4 mm apart
    assert RULE.radius(wide) == pytest.approx(0.324)


def test_a_ring_that_was_not_run_at_every_speed_is_not_chosen_but_counts_above_another():
    for radius, other in ((0.306, 0.307), (0.307, 0.306)):
        assert RULE.radius(without(study(), radius)) == other
    assert RULE.radius(without(study(with_force(115.0, 0.307, 9000.0)), 0.307)) == 0.308
    assert DURATIONS.radius(without(study(), 0.305)) == 0.306


def test_advice_names_force_price_wear_and_windows():
    assert advice(study(), RULE, DURATIONS) == [
        "recommended: a ring of radius 0.306 m",
        "the largest force of a tooth in a passage is 3900 N at 115 rpm and 2500 N at 210 rpm: 0.49 and 0.42 of that "
        "without a ring, at most 0.5 as asked",
        "its price: tension of the strand 1.05 times that without a ring, sliding of teeth and ring 70 -> 21 J a turn, "
        "motor power 280 -> 302 W, force of the ring 3000 N",
        "wear: the bound fails after at most 1 mm, at 0.305 m a tooth bears 0.56 of that without a ring at 115 rpm",
        "force of a tooth at most 0.5 of that without a ring, at every speed: 0.306 to 0.308 m (3 radii, up to 1 mm "
        "apart)",
        "right arc free, below 0.5 % of a turn, at every speed: 0.305 to 0.307 m (3 radii, up to 1 mm apart)",
        "a tooth is touched, at every speed: 0.304 to 0.308 m (5 radii, up to 1 mm apart)",
        "with another share instead of 0.5 the rule recommends 0.307 m with 0.3, 0.305 m with 0.7",
        "by contact durations, as the paper argues (right arc below 0.5 %, left arc at most a tooth's share of a turn "
        "and 2 points): 0.305 m; a tooth bears 0.56 of that without a ring at 115 rpm",
    ]
    names = compared(study(), RULE, DURATIONS).query("rpm == 115")["ring"].tolist()
    assert names == ["none", "smaller, by durations", "recommended", "larger, least force"]
    assert advice(study(with_force(115.0, 0.306, 4600.0)), RULE, DURATIONS)[0].endswith("0.307 m")
    assert advice(study({rpm: (9000.0,) * 4 + (1000.0,) for rpm in FORCE}), RULE, DURATIONS)[:2] == [
        "the recommended radius is the largest of the study, 0.308 m: a larger one may load a tooth by more",
        "recommended: a ring of radius 0.308 m",
    ]


def test_a_bound_kept_by_less_than_three_errors_is_not_decided():
    """At 115 rpm 0.306 m is 100 N below its bound, 0.307 m 2000 N; without a ring the force is known well."""
    undecided = "this is not decided: at 115 rpm the force is 0.4875 +- 0.0042 (standard error)"
    for error, radius in ((33.0, 0.306), (34.0, 0.307)):
        table = study(error=error)
        assert RULE.radius(table) == 0.306 and RULE.radius(table, ring_rule.DECIDED) == radius
        for words in (undecided, "a smaller step does, or a ring of 0.307 m"):
            assert (words in str(advice(table, RULE, DURATIONS))) == (radius == 0.307)


def test_a_friction_drive_is_named():
    sentences = advice(study(with_force(210.0, 0.306, 0.0)), RULE, DURATIONS)
    assert "friction drive: no tooth is touched at 210 rpm, only the ring drives" in sentences
    touched = "0.304 to 0.305 m (2 radii, up to 1 mm apart); 0.307 to 0.308 m (2 radii, up to 1 mm apart)"
    assert f"a tooth is touched, at every speed: {touched}" in sentences


def test_without_a_ring_that_serves_the_least_share_is_named():
    table = study({rpm: tuple(2.5 * force for force in forces) for rpm, forces in FORCE.items()})
    assert advice(table, RULE, DURATIONS)[:4] == [
        "no ring of these keeps the force of a tooth at 0.5 of that without a ring at every speed",
        "the least share that any keeps at every speed is 0.62: 0.307 m, at 115 rpm, on the left arc",
        "the right arc comes back at 0.308 m: 0.6 % of a turn at 115 rpm",
        "the largest ring of the study, 0.308 m: tension of the strand 1.1 times that without a ring",
    ]
    assert set(compared(table, RULE, DURATIONS)["ring"]) == {"none", "by durations", "least force"}


def test_a_ring_that_wears_keeps_the_bound_down_to_its_wear():
    """From 0.306 m on half is kept: with 1 mm of wear 0.307 m, with 2 mm 0.308 m, with more none."""
    worn = [RingRule(wear=wear) for wear in (0.0005, 0.001, 0.002, 0.0025)]
    assert [rule.radius(study()) for rule in worn] == pytest.approx([0.307, 0.307, 0.308, float("nan")], nan_ok=True)
    assert worn[0].refined(study()) == [0.3055, 0.3065]
    assert "wear: the bound fails after 2 to 3 mm, at 0.305 m" in advice(study(), worn[2], DURATIONS)[4]
    none = advice(study(), worn[3], DURATIONS)
    assert none[0].endswith("but not over 2.5 mm of wear: the widest window has 2 mm")
    assert "narrower" not in str(none)


def test_an_unknown_force_does_not_serve():
    # nor does a ring below one that is not known, in a step of the paper
    for unknown, radius in ((0.306, 0.307), (0.307, 0.308)):
        assert RULE.radius(study(with_force(210.0, unknown, float("nan")))) == radius
    lost = study()
    lost.loc[lost["ring_radius_m"].isna() & (lost["rpm"] == 210.0), ["left_peak_n", "right_peak_n"]] = float("nan")
    loaded = without(loaded_study(), None, load=3000.0)
    for table, load in ((without(study(), None), ""), (lost, ""), (loaded, " under 3000 N")):
        text = f"no ring can be chosen: the force of a tooth without a ring at 210 rpm{load} is not known"
        assert pd.isna(RULE.radius(table)) and advice(table, RULE, DURATIONS)[0] == text


@pytest.mark.parametrize(("field", "value"), [
    ("tooth_force", 0.0), ("tooth_force", 1.4), ("tooth_force", float("nan")), ("wear", -0.001), ("wear", float("inf")),
])  # fmt: skip
def test_a_rule_without_meaning_is_refused(field, value):
    meaning = {"tooth_force": "above 0 and at most 1", "wear": "a length"}[field]
    refused(RingRule, words=[f"{field} = {value:g}: must be {meaning}"], **{field: value})


def test_by_durations_both_arcs_must_keep_their_bounds():
    """The paper's criterion, in numbers of ours: half a percent for the right arc, 100 / 13 + 2 for the left one."""
    assert DURATIONS.radius(study()) == 0.305
    assert DURATIONS.radius(study(right_share_pct=0.6)) != 0.305
    for left, serves in ((9.69, True), (9.70, False)):
        assert (DURATIONS.radius(study(left_share_pct=left, right_share_pct=0.0)) == 0.304) == serves


def curve(radius, rpm):
    """A tooth is relieved near 0.306 m, with a second window of 0.4 mm below it."""
    return 2000.0 if 0.3041 <= radius <= 0.3045 or radius >= 0.30613 + 1e-6 * rpm else 7000.0


def made_up_study(monkeypatch, radii, of=curve, rule=RULE):
    """A study of the rig bench whose runs are a curve, and the lists of radii that were run."""
    run = []

    def table(scenes, *_):
        run.append(sorted({scene.ring_radius for scene in scenes} - {None}))
        return pd.DataFrame([
            {
                "rpm": scene.motor_rpm, "ring_radius_m": scene.ring_radius or float("nan"), "state": "done",
                "left_peak_n": of(scene.ring_radius, scene.motor_rpm) if scene.ring_radius else 8000.0,
                "right_peak_n": 0.0, "right_share_pct": 0.0, "left_share_pct": 9.0, "settled_tension_n": 3000.0,
            }
            for scene in scenes
        ])  # fmt: skip

    monkeypatch.setattr("trackdyn.sweeps.ring._study", table)
    return ring_study(BENCH, [115.0, 210.0], radii, rule=rule), run


@pytest.mark.parametrize("wear", [0.0, 0.002])
def test_three_grids_name_rings_that_agree(monkeypatch, wear):
    """A study looks between the last radius that misses and the first that serves, and a millimetre above that."""
    chosen, rule = [], RingRule(wear=wear)
    for first in (0.0, 0.0005, 0.0011):
        grid = [0.3000 + k * 0.0016 + first for k in range(8)]
        made, run = made_up_study(monkeypatch, grid, rule=rule)
        radius = rule.radius(made)
        window = next(window for window in windows(rule.kept(made)) if radius in window.radii)
        chosen.append(radius)
        assert len(run[-1]) - len(grid) <= (12 if wear else 6)
        assert made["added"].sum() == 2 * (len(run[-1]) - len(grid))
        assert any(radius < other <= radius * (1 + SPAN) for other in run[-1])
        assert window.first - window.below <= 5e-4 and radius - window.first >= wear - 1e-9
        # between the radii that it may wear through there is no gap where a dip could hide
        inside = [other for other in run[-1] if window.first <= other <= radius]
        assert all(high - low <= SPAN * radius for low, high in pairwise(inside))
    assert min(chosen) > 0.3061 + wear and max(chosen) - min(chosen) <= 5e-4


def test_a_narrow_window_is_named_and_not_chosen(monkeypatch):
    """Half is kept over 0.4 mm only, at an infinite speed; it is looked for around any radius that keeps it."""
    radii = [0.3030, 0.3043, 0.3060, 0.3070]
    made, run = made_up_study(monkeypatch, radii, lambda radius, _: curve(radius, float("inf")))
    sentences = advice(made, RULE, DURATIONS)
    assert sentences[0].startswith("no ring of these serves: 0.3043") and len(run) > 1
    assert sentences[1] == "the window is narrower than 0.5 mm, which a ring as made may miss"


def test_without_a_ring_that_serves_it_is_looked_for_beside_the_least_force(monkeypatch):
    """A window of 1.4 mm between two radii 2.5 mm apart, as on the rig m113."""

    def well(radius, rpm):
        return 2000.0 if 0.3046 <= radius <= 0.306 else 8000.0 + 2e6 * abs(radius - 0.306)

    made, run = made_up_study(monkeypatch, [0.2990, 0.3015, 0.3040, 0.3065, 0.3090], well)
    assert 0.3046 <= RULE.radius(made) < 0.3051 and len(run[-1]) <= 12


def test_the_advice_covers_a_ring_that_gives_way_in_shear():
    grips = pd.DataFrame(
        {"rpm": 210.0, "shear_stiffness": [1e6, 3e4], "tooth_ratio": [1.13, 0.47], "mobilised_friction": [0.1, 0.017]}
    )
    assert advice(study(), RULE, DURATIONS, grips)[4] == (
        "if the ring gives way in shear instead (friction_law: dahl), the force of a tooth at 210 rpm is 0.47 of that "
        "without a ring with 30 kN/m a link, a friction of 0.017 in use and 1.13 of that without a ring with 1000 kN/m "
        "a link, a friction of 0.1 in use: the choice depends on how much the ring grips"
    )
    both = advice(study(), RULE, DURATIONS, grips.assign(tooth_ratio=[0.5, float("nan")]))[4]
    assert "no result with 30 kN/m" in both and both.endswith("grips")
    assert advice(study(), RULE, DURATIONS, grips.assign(tooth_ratio=0.5))[4].endswith("the ring serves with both")


def test_a_window_claims_only_radii_that_were_run():
    """The middle of a gap is no end of a window; the distance of its radii is named."""
    wide, single = windows({0.3: False, 0.302: True, 0.3045: True, 0.305: True, 0.31: False, 0.312: True})
    assert [str(wide), str(single)] == ["0.302 to 0.305 m (3 radii, up to 2.5 mm apart)", "0.312 m"]
    assert wide[::2] == (0.3, 0.31) and pd.isna(single.above)


def test_rings_that_carry_nothing_are_refused_before_anything_runs():
    words = ["radii: the largest, 0.2985 m, carries nothing: ", "give larger radii"]
    refused(ring_study, BENCH, [115.0], [0.298, 0.2985], words=words, rule=RULE)
    assert 0.2985 < least_ring(BENCH) < 0.3


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
    worn = BENCH.changed(sprocket__equal_pitch_radius=0.314)
    radii, least = study_radii(worn), usual_rings(worn)[0]
    assert len(radii) == 11 and least > BENCH.ring_radius
    assert radii == pytest.approx(study_radii(worn.changed(sprocket__ring_radius=least)), abs=1e-4)


def test_a_narrow_range_has_all_radii_inside_it(monkeypatch):
    """A least ring between two hundredths of a millimetre is not rounded out of the range of a scene."""
    monkeypatch.setattr(rings, "usual_rings", lambda rig: (0.0802832, 0.0804149))
    radii = study_radii(load_rig("robot"))
    assert len(set(radii)) == 11 and 0.0802832 <= radii[0] < radii[-1] <= 0.0804149


def test_a_tensioner_without_room_for_a_ring_is_named():
    rig = BENCH.changed(sprocket__equal_pitch_radius=0.318, tension__travel=0.005)
    refused(study_radii, rig, words=["the least ring that carries the chain has 0.3", "tension.travel = "])


def test_the_least_ring_bears_the_chain_and_the_largest_tightens_it():
    """Half a millimetre below the least one nothing lies on the ring, above it a link of 100 N and its pull."""
    starts, (least, largest) = SettledLoops(), usual_rings(BENCH)
    loops = [Loop(Scene(BENCH, 115.0, radius), starts) for radius in (least - 5e-4, least + 5e-4, largest)]
    below, above, _ = (loop.work.wheel_force[:, 0].sum() for loop in loops)
    assert below == 0.0 and above > 100.0
    assert 3 < loops[-1].layout.settled_tension_n / BENCH.tension.pre_tension < 7


@pytest.mark.slow
def test_the_command_writes_its_files_and_goes_on_with_the_same_numbers(tmp_path, monkeypatch):
    """One scene against the recording that the pipeline makes of it; a second call computes no row again."""
    monkeypatch.chdir(tmp_path)
    line = ["ring", "bench", "--rpm", "210", "--radii", "0.3085", "--out", "mine", "-j1"]
    done = run_command(*line)
    assert done.code == 0 and "look at mine/ring.html" in done.out
    table = pd.read_csv("mine/ring.csv")
    assert table["ring_radius_m"].fillna(0).tolist() == [0.0, 0.3085] and set(table["state"]) == {"done"}
    rule = StopRule()
    recording, known = run_steady(Scene(BENCH, 210.0, 0.3085, **steady_fields(BENCH, 210.0, rule)), rule)
    summary, row = meshing_summary(recording), table.iloc[1]
    for name in ("left_share_pct", "ring_rms_n", "right_share_pct"):
        assert row[name] == pytest.approx(summary[name], rel=1e-8), name
    error = total_errors(recording.scene)("left_share_pct", summary["left_share_pct"], summary["left_share_error_pct"])
    assert row["left_share_error_pct"] == pytest.approx(error, rel=1e-8)
    assert row["contacts_converged"] == known
    names = {f"{name}.{end}" for name in ("force", "fig23_a", "fig23_b", "fig24", "sliding") for end in ("png", "svg")}
    assert names | {"ring.csv", "ring.html", "rows"} == {path.name for path in (tmp_path / "mine").iterdir()}
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}
    done = run_command(*line)
    assert done.code == 0 and "recommended: a ring of radius 0.3085 m" in done.out
    assert "with 30 kN/m a link, a friction of " in done.out
    assert stamps == {path: path.stat().st_mtime_ns for path in (tmp_path / "mine/rows").iterdir()}


def loaded_study():
    """The study with nothing to pull, and under 3 kN, which doubles the forces, with 0.306 m trebles them."""
    pulled = study({rpm: tuple(map(operator.mul, forces, (2.0, 2.0, 3.0, 2.0, 2.0))) for rpm, forces in FORCE.items()})
    pulled.loc[pulled["ring_radius_m"].isna(), "right_peak_n"] *= 2.0
    pulled["motor_power_w"] += 3000.0 * pulled["rpm"].map(CHAIN_SPEED)
    return pd.concat([study().assign(load_n=0.0), pulled.assign(load_n=3000.0)], ignore_index=True)


def test_a_ring_must_serve_under_every_load():
    """0.306 m has 11700 of 16000 N under 3 kN, 3900 of 8000 N without; each load has its own force without a ring."""
    table = loaded_study()
    assert RULE.radius(table[table["load_n"] == 0.0]) == 0.306
    assert RULE.radius(table) == RULE.radius(table[table["load_n"] == 3000.0]) == 0.307
    ratios = with_tooth_forces(table).set_index(["load_n", "rpm", "ring_radius_m"])["tooth_ratio"]
    assert ratios[(0.0, 115.0, 0.306)] == 3900 / 8000 and ratios[(3000.0, 115.0, 0.306)] == 11700 / 16000
    # a ring that was not run under one of the loads is none to choose
    assert RULE.radius(without(table, 0.307, load=0.0)) == 0.308
    sentences = "\n".join(advice(table, RULE, DURATIONS))
    assert sentences.startswith("recommended: a ring of radius 0.307 m\n")
    for words in (
        "is 2000 N at 115 rpm, 4000 N at 115 rpm under 3000 N, 1500 N at 210 rpm and 3000 N at 210 rpm under 3000 N: "
        "0.25, 0.25, 0.25 and 0.25 of that without a ring",
        "at 0.306 m a tooth bears 0.73 of that without a ring at 115 rpm under 3000 N",
        "right arc free, below 0.5 % of a turn, at every speed and load",
    ):
        assert words in sentences
    loads = compared(table, RULE, DURATIONS)[["rpm", "load_n"]].drop_duplicates().to_numpy().tolist()
    assert loads == [[rpm, load] for rpm in BARE for load in (0.0, 3000.0)]


def test_the_advice_names_its_loads_and_the_drag():
    """Motor power over the speed of the chain, less the load: 302 W at 115 and 210 rpm, 303 W with 0.307 m."""
    free = study().assign(load_n=0.0)
    for table, text in (
        (free, "a track that pulls nothing: the motor overcomes its own drag, 226 to 414 N"),
        (loaded_study(), "loads of 0 and 3000 N on the chain, in addition to its own drag, 227 to 415 N"),
    ):
        assert ring_rule.held_for(table, RULE, BENCH) == f"this holds for {text}"
    assert "overcomes its own drag" in ring_rule.held_for(free.assign(motor_power_w=float("nan")), RULE, BENCH)


def test_a_load_is_a_series_of_the_figures():
    figure = force_figure(with_tooth_forces(loaded_study()), 0.5, 0.307, windows(RULE.kept(loaded_study())))
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:4] == ["115 rpm", "115 rpm under 3000 N", "210 rpm", "210 rpm under 3000 N"]
    assert len({line.get_color() for line in figure.axes[0].get_lines() if len(line.get_xdata()) == len(RADII)}) == 4


def test_a_study_with_a_scene_that_failed_recommends_nothing(monkeypatch, rig):
    """Without the rows of an interrupted refinement another ring was recommended."""

    def computed(asked, *_):
        states = ["done"] * (len(asked) - 1) + ["failed"]
        return [{"key": "", "state": state, "reason": "no memory", "values": {}} for state in states]

    monkeypatch.setattr("trackdyn.sweeps.ring.computed_rows", computed)
    words = ["may pass (no memory); run the study again"]
    refused(ring_study, rig, [115.0], [0.308], error=TrackdynError, words=words)


def test_a_row_of_a_study_has_its_load_in_its_key(monkeypatch, rig):
    """Only where it is not the rig's own: a study without loads has the rows that it had."""
    rows = []

    def computed(asked, *_):
        rows.extend(asked)
        return [{"key": row.key, "state": "refused", "reason": "", "values": {"left_peak_n": 1.0}} for row in asked]

    monkeypatch.setattr("trackdyn.sweeps.ring.computed_rows", computed)
    monkeypatch.setattr("trackdyn.sweeps.ring.METRIC_COLUMNS", {})
    table = ring_study(rig, [115.0], [0.308], loads=[2000.0, 0.0])
    conditions = table[["rpm", "load_n", "ring_radius_m"]].fillna(0.0).to_numpy().tolist()
    assert conditions == [[115.0, load, radius] for radius in (0.0, 0.308) for load in (0.0, 2000.0)]
    assert [row.task["scene"].get("load") for row in rows] == [None, 2000.0] * 2
    assert len({row.key for row in rows}) == 4
    before = [row.key for row in rows if "load" not in row.task["scene"]]
    rows.clear()
    assert ring_study(rig, [115.0], [0.308])["load_n"].tolist() == [0.0, 0.0]
    assert [row.key for row in rows] == before
    assert ring_study(rig.changed(load=500.0), [115.0], [0.308])["load_n"].tolist() == [500.0, 500.0]
    refused(ring_study, rig, [115.0], [0.308], words=["load = -1"], loads=[-1.0])
