"""Files of rigs: short forms, inheritance, refusals, and the commands about them."""

import contextlib
import pickle
import warnings

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tests.conftest import refused, run_command, written
from trackdyn import InputError, Scene, check, load_rig
from trackdyn.rig.layout import assemble, belt_around, run_order, wheel_names
from trackdyn.rig.rig import foreign_groove, parameter_table
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.build import make_suspensions

WHEEL = "{x: -1.05 m, y: 0.0 m, radius: 0.28 m, inertia: 3.0 kg m2}"
ARM = "x: 1.0 m, y: 0.0 m, mass: 1.0 kg, stiffness: 1.0 N m/rad, damping: 0.0 N m s/rad, travel: 5.0 deg"
ROLLER = """
like: bench
chain: {source: "08B-1", kind: single_pin, pitches: 84, pitch: 0.0127 m, link_length: 0.0125 m, link_thickness: 0.004 m,
  connector_radius: 0.00425 m}
sprocket: {source: x, teeth: 21}
"""
PINS = """like: robot
chain: {source: "singlePin.json", kind: single_pin, pitch: 0.17 m, link_length: 0.1145 m, link_thickness: 0.06 m}
sprocket: {source: "its own", teeth: 12}
groove: {source: "wide enough", seat_depth: 0.001 m, slope_bottom: 30.0 deg, slope_low: 0.0 deg, slope_seat: 5.0 deg,
  slope_tip: 60.0 deg, r2: 0.05 m, r3: 0.02 m, r4: 0.02 m, r5: 0.04 m}
"""


def like_bench(field):
    return f"like: bench\nwheels: {{source: s, idler: {WHEEL[:-1]}, {field}}}}}\n"


def arrays_of(rig):
    for fields in (
        {"tension": "sprung", "drag": "rolling", "bushing_law": "hysteretic"}, {"drag": "coulomb"},
        {"drag": "viscous", "bushing_law": "viscous"}, {"closure": "elastic_damping"}, {"space": "spatial"},
        {"rig": rig.changed(ring_contact__friction_law="dahl")},
    ):  # fmt: skip
        scene = Scene(**{"rig": rig, "motor_rpm": 115.0, "step": 1e-6} | fields)
        suspensions = make_suspensions(rig, scene.model, scene.tension, 0.0)
        yield pickle.dumps(scene.model._replace(suspensions=suspensions))


def test_every_parameter_of_a_rig_has_an_effect():
    rig = load_rig("paper").changed(idler__seal_drag=1.0, road_wheel__seal_drag=1.0)
    before, unread = list(arrays_of(rig)), set()
    for name, field in rig.fields.items():
        if isinstance(field.value, bool | str) or field.value is None:
            continue
        change = 1 if isinstance(field.value, int) else 0.01 * field.value or 1e-3
        down = name.endswith(("poisson_ratio", "friction_dynamic"))  # upwards is not allowed
        value = field.value - change if down else field.value + change
        with contextlib.suppress(InputError):  # refused: it is read
            if list(arrays_of(rig.changed(**{name: value}))) == before:
                unread.add(name)
    # read where the loop settles, and where the sensor's signal is clipped
    assert unread == {"sensor.range", "tension.pre_tension"}


@pytest.mark.parametrize(("text", "fragments"), [
    (f"like: bench\nwheels:\n  idler: {WHEEL}\n", ["wheels.idler.x = '-1.05 m'", "has no source"]),
    ("like: nowhere\n", ["rig = 'nowhere'", "no such file", "bench, m113, paper, parts"]),
    ("like: mine.yaml\n", ["like = 'mine.yaml'", "without an end"]),
    ("like: bench\nwheels: {source: s, idler: {x: 1 mm}}\n", ["idler.x", "must be given in 'm'"]),
    ("like: bench\nwheels: {source: s, Big Wheel: " + WHEEL + "}\n", ["wheels", "Big Wheel", "lower-case letters"]),
    (f"like: bench\nwheels: {{source: s, chain: {WHEEL}}}\n", ["wheels", "'chain'", "not the name of a section"]),
    ("like: bench\nwheels: {source: s, rear: " + WHEEL + "}\n", ["tension.wheel = 'idler'", "choose 'rear'"]),
    (like_bench("surface: soft"), ["idler.surface = 'soft'", "wheel_contact"]),
    ("like: bench\ndrive: {source: s, kind: motor}\n", ["drive is not a known parameter; remove it"]),
    ("like: bench\ntension: {source: s, force: 10.0 N}\n", ["tension.force is not a known parameter; remove it"]),
    ("like: bench\ntension: {source: s, kept: forced}\n", ["tension.kept = 'forced': ", "'sprung'"]),
    ("like: bench\nprofile: {source: s}\n", ["profile.arcs is missing"]),
    ("like: bench\nprofile: {source: s, outline: tooth.csv}\n", ["profile.outline is not a known parameter"]),
    (like_bench(f"arm: {{{ARM}}}"), ["tension.wheel = 'idler'", "choose a fixed wheel"]),
    ("like: bench\nsprocket: {source: s, teeth: 17}\n", ["17 teeth leave 0.", "sprocket.equal_pitch_radius"]),
    (ROLLER, ["the groove is that of parts (13 teeth, pitch 0.", ": state groove or profile", "slope_tip"]),
    ('like: "a\\0b"\n', ["like = 'a\\x00b': must be the name of an included rig or of a file"]),
    ("like: paper\nchain: {link_length: '\u0660.\u0661 m'}\n", ["link_length"]),
    # a pitch that gives no sprocket
    (PINS.replace("single_pin, pitch: 0.17", "double_pin, pitch: 0.11"), ["more than chain.link_length = 0.1145 m"]),
    (PINS.replace("teeth: 12", "teeth: 12, equal_pitch_radius: 0.29 m"),
     ["chain.pitch gives sprocket.equal_pitch_radius; leave"]),
    (PINS.replace("teeth: 12", "teeth: .inf"), ["sprocket.teeth = inf: must be a finite number"]),
    *((PINS.replace("pitch: 0.17 m", f"pitch: {pitch}"), [f"chain.pitch {words}"]) for pitch, words in (
        ("0.01 m", "= 0.01: must be a length in m, such as 0.17 m"), ("-0.17 m", "= -0.17: must be a length in m"),
        ("170 mm", "has the unit 'mm'; it must be given in 'm'"), ("{value: 0.17, unit: m}", "lacks kind, source"),
        ("[1]", "= [1] has no unit"),
    )),
])  # fmt: skip
def test_a_bad_file_is_refused_by_file_and_field(tmp_path, text, fragments):
    path = written(tmp_path / "mine.yaml", text)
    refused(load_rig, path, words=[*fragments, "" if "nowhere" in text else str(path)])


def test_the_order_of_the_wheels_is_that_of_a_rubber_band():
    """Against the convex hull of many points of the circles; a large one between small ones is met twice."""
    rng, angle = np.random.default_rng(5), np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    for _ in range(300):
        n = int(rng.integers(2, 9))
        circles = np.column_stack([rng.uniform(-2, 2, (n, 2)), rng.uniform(0.05, 0.5, n)])
        order = run_order(circles)
        points = np.vstack([[x, y] + r * directions for x, y, r in circles])
        hull = set((ConvexHull(points).vertices // 2000).tolist())
        # a wheel with an arc shorter than the distance of two points may be missing in the hull
        assert hull <= set(order) and len(set(order) - hull) <= 1
        assert 0 not in order or order[0] == 0
    circles = np.array([[0.0, 0.0, 0.2], [-3.0, 0.0, 0.2], [-1.5, 0.0, 0.5]])
    assert sorted(run_order(circles)) == [0, 1, 2, 2]


def test_a_wheel_far_within_is_refused_and_one_under_a_sagging_strand_is_not():
    rig = load_rig("vehicle")
    assert "carrier" not in [wheel_names(rig)[i] for i in belt_around(rig)[1]]
    refused(belt_around, rig.changed(carrier__y=-0.1), match=r"wheel carrier at .* would not touch the loop")
    overlap = r"wheels sprocket \(radius .*\) and road_1 \(.*\) are .* m apart and overlap"
    refused(belt_around, rig.changed(road_1__x=-0.3), match=overlap)
    refused(assemble, rig.changed(carrier__y=2.0), match="too short")


def test_the_pitch_of_a_single_pin_chain_gives_the_equal_pitch_radius(tmp_path):
    """The polygon of twelve pins 0.17 m apart has an apothem of 0.31722 m, half a thickness above the ring."""
    path = written(tmp_path / "mine.yaml", PINS)
    rig = load_rig(path)
    assert rig.sprocket.equal_pitch_radius == rig.sprocket.ring_radius == pytest.approx(0.28722, abs=5e-6)
    assert rig.single_pin_pitch == pytest.approx(0.17, rel=1e-12)
    readings = rig.equal_pitch_radii
    assert readings["polygon"] == pytest.approx(rig.sprocket.equal_pitch_radius, rel=1e-9)
    assert readings["pins"] == pytest.approx(readings["chord"], rel=1e-12)  # a pitch is one chord
    assert readings["pins"] == pytest.approx(0.298415, abs=5e-7)
    assert parameter_table(path).set_index("name").at["sprocket.equal_pitch_radius", "kind"] == "derived"

    def with_sprocket(text):
        return load_rig(written(tmp_path / "other.yaml", f"like: mine.yaml\nsprocket: {{source: x, {text}}}\n"))

    assert with_sprocket("teeth: 13").single_pin_pitch == pytest.approx(0.17, rel=1e-12)
    double = written(tmp_path / "double.yaml", PINS.replace("kind: single_pin", "kind: double_pin"))
    assert load_rig(double).pitch == pytest.approx(0.17, rel=1e-9)
    assert with_sprocket("equal_pitch_radius: 0.29 m, ring_radius: 0.291 m").sprocket.equal_pitch_radius == 0.29


@pytest.mark.parametrize("name", ["bench", "robot", "vehicle"])
def test_a_worn_chain_is_one_line_and_leaves_tooth_and_ring_as_they_are(tmp_path, name):
    new = load_rig(name)
    text = f'like: {name}\nchain: {{source: "worn by 1 %", pitch: {1.01 * new.pitch!r} m}}\n'
    worn = load_rig(written(tmp_path / "mine.yaml", text))
    assert worn.pitch == pytest.approx(1.01 * new.pitch, rel=1e-9) and worn.chain == new.chain
    assert worn.sprocket.ring_radius == new.sprocket.ring_radius
    np.testing.assert_allclose(worn.groove_profile.profile(), new.groove_profile.profile(), rtol=0, atol=1e-12)
    older = written(tmp_path / "older.yaml", "like: mine.yaml\nsensor: {source: x, x: 0.01 m}\n")
    assert load_rig(older).groove == worn.groove


def test_a_groove_of_other_arcs_is_reported_of_files_and_recordings_and_by_simulate(tmp_path, monkeypatch):
    arc = 0.98 * load_rig("bench").chain.connector_radius
    path = written(tmp_path / "mine.yaml", f"like: bench\nchain: {{source: x, connector_radius: {arc!r} m}}\n")
    remark = foreign_groove(load_rig(path), path)
    assert remark.startswith("the groove is that of parts (13 teeth") and remark.endswith("state groove or profile")
    assert foreign_groove(load_rig(path)).startswith("the groove is that of ")  # a recording knows no file
    for name in shipped_rigs():
        assert not foreign_groove(load_rig(name)) and not foreign_groove(load_rig(name), name)
    monkeypatch.setattr("trackdyn.commands.recordings._for_its_duration", lambda *_: None)
    for rig, warned in ((path, True), ("bench", False)):
        assert (remark in run_command("simulate", tmp_path / "run.npz", "--rig", rig, "--rpm", "115").err) == warned


def test_the_law_of_drag_follows_the_values_of_the_wheels(tmp_path):
    for value, law in (
        ("bearing_drag: 1.0 N m s/rad", "viscous"), ("bearing_torque: 1.0 N m", "coulomb"),
        ("rolling_arm: 0.005 m", "rolling"),
        ("rolling_arm: 0.005 m, bearing_drag: 1.0 N m s/rad", load_rig("bench").drag),
    ):  # fmt: skip
        assert load_rig(written(tmp_path / "mine.yaml", like_bench(value))).drag == law


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
