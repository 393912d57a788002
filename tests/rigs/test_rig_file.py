"""Files of rigs: shipped ones by name, the short way of writing, what is taken from another file, and what is
refused.
"""

import pickle
import warnings

import numpy as np
import pytest
import yaml

from trackdyn.errors import InputError
from trackdyn.parameters.layout import assemble, belt_around, run_order, wheel_names
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import DEFAULT, read_rig, shipped_rigs
from trackdyn.parameters.table import parameter_table
from trackdyn.scene.carriers import make_carriers
from trackdyn.scene.limits import round_step
from trackdyn.scene.scene import Scene

OWN = ("bench", "m113", "robot", "vehicle")  # the others are the pipeline's files
MOST_LINES = 62  # two of them the note of where the data are

WHEEL = "{x: -1.05 m, y: 0.0 m, radius: 0.28 m, inertia: 3.0 kg m2}"


def written(tmp_path, text):
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_package_has_the_pipelines_rigs_and_its_own(rig, rig_path, default_rig_path):
    assert set(shipped_rigs()) == {*OWN, "first_fit", "paper", "possible"}
    assert load_rig() == load_rig(DEFAULT) == load_rig(default_rig_path) != rig == load_rig("first_fit")
    for name, path in (("paper", default_rig_path), ("first_fit", rig_path)):
        assert shipped_rigs()[name].read_bytes() == path.read_bytes(), "one source of truth"


@pytest.mark.parametrize("name", OWN)
def test_a_shipped_file_is_short_and_every_value_has_a_source(name):
    path = shipped_rigs()[name]
    assert path.read_text(encoding="utf-8").count("\n") <= MOST_LINES
    table = parameter_table(path)
    assert table["source"].str.strip().ne("").all() and table["kind"].ne("").all()
    assert not table["name"].duplicated().any()
    # what a file states itself is what the rig has: the short form loses nothing
    own = yaml.safe_load(path.read_text(encoding="utf-8"))
    for wheel, part in own["wheels"].items():
        if isinstance(part, dict):
            assert float(part["radius"].split()[0]) == load_rig(name).rollers[wheel].radius


def test_the_paper_is_dumped_as_before(rig):
    """What a rig does not use is not in its data, and with it not in what is hashed and stored."""
    data = rig.model_dump()
    assert not {"wheels", "surfaces", "drive", "profile"} & set(data)
    assert set(data["idler"]) == {
        "x", "y", "axial_offset", "toe", "camber", "radius", "inertia", "bearing_drag", "bearing_torque", "rolling_arm",
    }  # fmt: skip
    assert "kept" not in data["tension"] and "kind" not in data["chain"] and "ring" not in data["sprocket"]


def test_values_that_the_laws_of_a_file_do_not_read_are_named(tmp_path):
    """The file's own ones, whether it states the law or takes it from the rig that it is like."""
    wheel = WHEEL[:-1] + ", rolling_arm: 0.005 m}"
    text = f"like: bench\nwheels:\n  source: my own\n  idler: {wheel}\n"
    with pytest.warns(UserWarning, match=r"mine\.yaml: idler\.rolling_arm has no effect: drag is viscous") as seen:
        rig = load_rig(written(tmp_path, text))
    assert len(seen) == 1 and "idler.rolling_arm" in rig.without_effect
    rolling = "drag: {value: rolling, unit: name, kind: assumed, source: tyres}\n"
    sprung = "tension: {source: s, stiffness: 1.0e5 N/m}\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "idler.rolling_arm" not in load_rig(written(tmp_path, text + rolling)).without_effect
        for name in shipped_rigs():  # which have values for every law
            load_rig(name)
    with pytest.warns(UserWarning, match=r"tension\.stiffness has no effect: .*tension\.kept locked"):
        load_rig(written(tmp_path, text + rolling + sprung))


# read where the loop settles, and where the sensor's signal is clipped
NOT_IN_A_MODEL = {"sensor.range", "tension.pre_tension"}
SCENES = (
    {}, {"tension": "sprung", "drag": "rolling", "bushing_law": "hysteretic"}, {"drag": "coulomb"},
    {"joint": "radial"}, {"closure": "elastic_damping"}, {"space": "spatial"},
)  # fmt: skip


def arrays_of(rig):
    """All numbers that a simulation of a rig is made of, of several scenes."""
    found = []
    for fields in SCENES:
        scene = Scene(rig, 115.0, step=1e-6, **fields)
        model = scene.model
        if scene.tension == "sprung":
            model = model._replace(carriers=make_carriers(rig, model, "sprung", 0.0))
        found.append(pickle.dumps(model))
    return found


def test_every_parameter_of_a_rig_is_read_by_something():
    """A field that nothing reads would be set in a user's file without effect."""
    rig = load_rig("paper").changed(idler__seal_drag=1.0, road_wheel__seal_drag=1.0)
    before = arrays_of(rig)
    unread = set()
    for name, field in rig.fields.items():
        if isinstance(field.value, bool | str) or field.value is None:
            continue
        change = 1 if isinstance(field.value, int) else 0.01 * field.value or 1e-3
        down = name.endswith(("poisson_ratio", "friction_dynamic"))  # upwards is not allowed
        value = field.value - change if down else field.value + change
        try:
            if arrays_of(rig.changed(**{name: value})) == before:
                unread.add(name)
        except InputError:
            continue  # refused: it is read
    assert unread == NOT_IN_A_MODEL


def test_short_values_have_units_and_their_sections_source(tmp_path):
    path = written(
        tmp_path,
        f"like: bench\nwheels:\n  source: my own\n  idler: {WHEEL}\nchain: {{source: counted, kind: "
        f"derived, pitches: 26}}\n",
    )
    entries = read_rig(path)
    assert entries["chain"]["pitches"] == {"value": 26, "unit": "1", "kind": "derived", "source": "counted"}
    assert entries["idler"]["radius"] == {"value": 0.28, "unit": "m", "kind": "assumed", "source": "my own"}
    assert load_rig(path).chain.pitches == 26
    assert load_rig(path).idler.toe == 0.0


def test_a_wheel_is_a_section_by_its_name():
    rig = load_rig("m113")
    assert wheel_names(rig)[:2] == ("sprocket", "idler")
    assert rig.changed(road_3__radius=0.3).rollers["road_3"].radius == 0.3
    assert rig.changed(road_3__arm__stiffness=3e4).rollers["road_3"].arm.stiffness == 3e4
    assert rig.changed(road_3__arm=None).rollers["road_3"].carrier is None
    with pytest.raises(InputError, match=r"'road_9\.radius' is not a parameter"):
        rig.changed(road_9__radius=0.3)
    with pytest.raises(InputError, match=r"road_3\.radius = -0\.3"):
        rig.changed(road_3__radius=-0.3)
    assert {"road_3.radius", "road_3.arm.stiffness"} <= set(parameter_table(shipped_rigs()["m113"])["name"])


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        (f"like: bench\nwheels:\n  idler: {WHEEL}\n", ["wheels.idler.x = '-1.05 m'", "has no source"]),
        ("like: nowhere\n", ["rig = 'nowhere'", "no such file", "bench, first_fit, m113, paper"]),
        ("like: mine.yaml\n", ["like = 'mine.yaml'"]),
        ("like: bench\nwheels: {source: s, idler: {x: 1 mm}}\n", ["idler.x", "must be given in 'm'"]),
        ("like: bench\nwheels: {source: s, Big Wheel: " + WHEEL + "}\n", ["wheels", "Big Wheel", "lower-case letters"]),
        (
            "like: bench\nwheels: {source: s, chain: " + WHEEL + "}\n",
            ["wheels", "'chain'", "not the name of a section"],
        ),
        ("like: bench\nwheels: {source: s, rear: " + WHEEL + "}\n", ["tension.wheel = 'idler'", "choose 'rear'"]),
        (
            f"like: bench\nwheels: {{source: s, idler: {WHEEL[:-1]}, surface: soft}}}}\n",
            ["idler.surface = 'soft'", "wheel_contact"],
        ),
        ("like: bench\ntension: {source: s, kept: forced}\n", ["tension.force is missing"]),
        ("like: bench\ntension: {source: s, kept: glued}\n", ["tension.kept = 'glued'", "'locked'"]),
        ("like: bench\ndrive: {source: s, kind: motor}\n", ["drive.inertia is missing"]),
        ("like: bench\ndrive: {source: s, ripple: 1.5 1}\n", ["drive.ripple = 1.5", "less than 1"]),
        ("like: bench\nprofile: {source: s}\n", ["profile needs arcs or outline"]),
        (
            f"like: bench\nwheels: {{source: s, idler: {WHEEL[:-1]}, arm: {{x: 1.0 m, y: 0.0 m, mass: "
            "1.0 kg, stiffness: 1.0 N m/rad, "
            "damping: 0.0 N m s/rad, travel: 5.0 deg}}}\n",
            ["tension.wheel = 'idler'", "choose a fixed wheel"],
        ),
    ],
)
def test_a_bad_file_is_refused_by_file_and_field(tmp_path, text, fragments):
    path = written(tmp_path, text)
    sentence = refusal(path)
    for fragment in [*fragments, *([str(path)] if "nowhere" not in text else [])]:
        assert fragment in sentence, sentence


def hull_points(circles, per_circle=2000):
    """Corners of the convex hull of many points of the circles, by an independent method, and the circle of each."""
    from scipy.spatial import ConvexHull

    turn = np.linspace(0, 2 * np.pi, per_circle, endpoint=False)
    points = np.vstack([[x + r * np.cos(turn), y + r * np.sin(turn)] for x, y, r in circles]).reshape(-1, 2, per_circle)
    points = points.transpose(0, 2, 1).reshape(-1, 2)
    return np.unique(ConvexHull(points).vertices // per_circle)


def test_the_order_of_the_wheels_is_that_of_a_rubber_band():
    """Against the convex hull of points on the circles; wheels within are not in it."""
    rng = np.random.default_rng(5)
    for _ in range(300):
        n = int(rng.integers(2, 9))
        circles = np.column_stack([rng.uniform(-2, 2, (n, 2)), rng.uniform(0.05, 0.5, n)])
        order = run_order(circles)
        found = set(hull_points(circles).tolist())
        # a wheel whose arc is shorter than the points are apart may be missing there
        assert found <= set(order)
        extra = set(order) - found
        assert len(extra) <= 1, "points as dense as these miss no more"
        if 0 in order:
            assert order[0] == 0


def test_a_large_wheel_between_small_ones_is_met_twice():
    circles = np.array([[0.0, 0.0, 0.2], [-3.0, 0.0, 0.2], [-1.5, 0.0, 0.5]])
    assert sorted(run_order(circles)) == [0, 1, 2, 2]


def test_wheels_on_one_line_come_one_after_the_other():
    circles = np.array([[0.0, 0.3, 0.3], *[[-x, 0.0, 0.3] for x in (0.7, 1.4, 2.1, 2.8)]])
    assert run_order(circles) == [0, 1, 2, 3, 4]


def test_a_wheel_far_within_is_refused_and_one_under_a_sagging_strand_is_not():
    rig = load_rig("vehicle")
    assert "carrier" not in [wheel_names(rig)[i] for i in belt_around(rig)[1]]
    with pytest.raises(InputError, match=r"wheel carrier at .* would not touch the loop"):
        belt_around(rig.changed(carrier__y=0.0))
    with pytest.raises(
        InputError, match=r"wheels sprocket \(radius .* m\) and road_1 \(.* m\) are .* m apart and overlap"
    ):
        belt_around(rig.changed(road_1__x=-0.3))
    with pytest.raises(InputError, match="too short"):
        assemble(rig.changed(carrier__y=2.0))


def test_a_misspelt_field_is_named_before_the_one_that_is_then_missing(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "like: bench\nwheels:\n  source: a tape\n  idler: {x: -1.05 m, y: 0.0 m, raduis: 0.28 m, inertia: 3.0 kg m2}\n"
    )
    with pytest.raises(
        InputError, match=r"raduis is not a known parameter; remove it or correct its spelling \(radius\?\)"
    ):
        load_rig(path)


@pytest.mark.parametrize(("limit", "step"), [(9.6e-5, 6.25e-5), (3.8e-5, 3.125e-5), (5e-5, 5e-5), (2.0, 1e-3)])
def test_a_step_that_is_proposed_can_be_typed(limit, step):
    """It divides the sample interval of 1 ms exactly as it is written, and lies within the limit."""
    assert round_step(limit, 1e-3) == pytest.approx(step, rel=1e-12)
    assert 1e-3 / float(f"{round_step(limit, 1e-3):.7g}") == pytest.approx(round(1e-3 / step), abs=1e-9)
