"""Several sensors on one rig: each reads as the only one would, and is compared with its own group of a file."""

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.conftest import BELT, LAWS, recorded, refused, run_command, written
from trackdyn import Scene, load_recording, load_rig, measures, read_sensor, sense, simulate
from trackdyn.fieldtest.compare import compare_with_sensor
from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.measure.metrics import remarks

COMMON = {"rate": 1000, "range": 20.0}
PLACES = {
    "front": COMMON | {"pitch": 4, "x": 0.03, "y": 0.02},
    "rear": COMMON | {"pitch": 20, "body": "connector", "x": 0.01, "y": -0.01},
}
RUNS = {
    "semi_implicit": (0.0, {}), "turned plane": (0.5, {}), "belt": (0.0, BELT),
    "linearly_implicit": (0.0, {"integrator": "linearly_implicit", "step": 5e-4}),
    "rk4": (0.0, {"integrator": "rk4", "step": 5e-5}), "spatial": (0.0, {"space": "spatial", **LAWS}),
}  # fmt: skip


@pytest.mark.parametrize(("toe", "fields"), RUNS.values(), ids=RUNS)
def test_two_sensors_read_as_each_as_the_only_one(make_scene, rig, toe, fields):
    fields = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.2, "motor_rpm": 210.0} | fields
    rig = rig.changed(idler__toe=toe)
    run = simulate if fields.get("chain") else recorded
    both = run(make_scene(rig=rig.changed(sensors=PLACES), **fields))
    assert list(both.sensors) == ["front", "rear"]
    for k, (name, sensor) in enumerate(PLACES.items()):
        single = run(make_scene(rig=rig.changed(sensor=sensor), **fields))
        np.testing.assert_array_equal(both.mean[:, k], single.mean[:, 0])
        np.testing.assert_array_equal(both.raw[:, k], single.raw[:, 0])
        for signal in (sense(both, sensor=name), sense(both, sensor=k), sense(both.with_sensor(name))):
            np.testing.assert_array_equal([signal.ax, signal.ay], [sense(single).ax, sense(single).ay])
        np.testing.assert_array_equal(both.energy, single.energy)


def test_the_pin_that_two_bodies_share_has_one_acceleration(make_scene, rig):
    ends = (9, "link", rig.chain.link_length), (9, "connector", 0.0), (9, "connector", rig.connector_length)
    ends = {
        f"end_{k}": COMMON | {"pitch": pitch, "body": body, "x": x, "y": 0.0}
        for k, (pitch, body, x) in enumerate((*ends, (10, "link", 0.0)))
    }
    recording = recorded(make_scene(210.0, rig=rig.changed(sensors=ends), duration=0.02, lead_in=0.0, ramp=0.2))
    pins = recording.raw[..., :2] @ [1, 1j] * np.exp(1j * recording.raw[..., 2])
    size = np.abs(pins).max()
    np.testing.assert_allclose(pins[:, [0, 2]], pins[:, [1, 3]], rtol=0, atol=1e-9 * size)
    assert np.abs(pins[:, 1] - pins[:, 2]).max() > 1e-3 * size


def test_on_a_belt_a_connector_follows_its_link_by_half_a_pitch(rig):
    on_link = COMMON | {"pitch": 7, "x": rig.chain.link_length / 2, "y": 0.01}
    on_connector = on_link | {"body": "connector", "x": rig.connector_length / 2}
    moving = rig.changed(sensors={"link": on_link, "connector": on_connector})
    rpm = 210.0 * Scene(moving, 210.0, **BELT).periods.passage / 0.1  # half a passage lasts 50 samples
    recording = simulate(Scene(moving, rpm, duration=1.0, **BELT))
    ax, ay, angle = np.moveaxis(recording.raw, -1, 0)
    for values in (ax, ay, np.exp(1j * angle)):
        np.testing.assert_allclose(values[50:, 0], values[:-50, 1], rtol=0, atol=1e-9)


def test_measures_and_limits_are_those_of_each_sensor(rig):
    near = PLACES | {"rear": PLACES["rear"] | {"range": 0.9}}
    recording = simulate(Scene(rig.changed(sensors=near), 210.0, duration=10.0, **BELT))
    table = measures(recording)
    assert list(table.loc["rms_g"].sensor) == ["front", "rear"]
    for name in near:
        single = measures(recording.with_sensor(name))
        assert "sensor" not in single
        rows = table[table.sensor == name]
        assert rows.value.to_dict() == single.value[rows.index].to_dict()
    (limited,) = [text for text in remarks(recording) if "range" in text]
    assert "range of 0.9 g" in limited and "(rear.range of the rig)" in limited


def test_every_link_puts_sensors_where_the_first_one_is(make_scene, rig):
    sensors = make_scene(rig=rig.changed(sensors=PLACES), every_link=True).sensors
    assert len(sensors) == 2 + rig.chain.pitches and sensors["link 4"] == sensors["front"]
    assert all((s.x, s.y) == (0.03, 0.02) for s in sensors.values() if s.body == "link")


def test_what_no_recording_has_is_refused(rig):
    places = rig.changed(sensors=PLACES)
    recording = simulate(Scene(places, 210.0, duration=0.1, **BELT))
    for sensor, words in (("middle", "'front', 'rear'"), (2, "between 0 and 1"), (0.5, "sensor")):
        refused(sense, recording, sensor=sensor, words=[words])
    refused(Scene, places, 115.0, chain="single_pin", words=["sensor on a connector"])


FILE = """
like: paper
sensors:
  source: "tape measure"
  front: {pitch: 4, x: 0.03 m, y: 0.02 m, rate: 1000 Hz, range: 20 g}
  rear: {pitch: 20, body: connector, x: 0.01 m, y: -0.01 m, rate: 1000 Hz, range: 20 g}
"""
SINGLE = "sensor: {source: tape, pitch: 3, x: 0.0 m, y: 0.0 m, rate: 1000 Hz, range: 20 g}"


@pytest.mark.parametrize(("before", "after", "words"), [
    ("rear:", "front:", "gives 'front' a second time"),
    ("rear:", "Rear:", "sensors.'Rear' is not a valid name"),
    ("body: connector", "body: wheel", "sensors.rear.body = 'wheel'"),
    ("pitch: 20", "pitch: 20000", "rear.pitch = 20000 is not a pitch of this chain; 1 to "),
    ("y: -0.01 m, rate: 1000 Hz", "y: -0.01 m, rate: 500 Hz", "rear.rate = 500 Hz: another sensor has 1000 Hz"),
    (", range: 20 g}\n  rear", "}\n  rear", "sensors.front.range is missing"),
    ("sensors:", "sensor: {source: tape, pitch: 3}\nsensors:", "sensors.sensor.x is missing"),
    (FILE[FILE.index("  source") :], "  source: tape\n", "sensors is missing; a rig needs at least one"),
])  # fmt: skip
def test_a_file_of_sensors_that_cannot_be_is_refused_in_one_sentence(tmp_path, before, after, words):
    path = written(tmp_path / "mine.yaml", FILE.replace(before, after))
    refused(load_rig, path, words=[words, str(path)])


def test_a_file_may_name_several_sensors(tmp_path):
    rig = load_rig(written(tmp_path / "mine.yaml", FILE))
    assert list(rig.sensors) == ["front", "rear"] and rig.sampled(2000).rate == 2000
    assert rig.value("rear.body") == "connector" and rig.changed(rear__x=0.02).sensors["rear"].x == 0.02
    child = written(tmp_path / "child.yaml", f"like: mine.yaml\n{SINGLE}\n")
    assert list(load_rig(child).sensors) == ["front", "rear", "sensor"]


@pytest.fixture(scope="module")
def compared(tmp_path_factory, rig):
    folder = tmp_path_factory.mktemp("two")
    recording = simulate(Scene(rig.changed(sensors=PLACES), 210.0, duration=20.0, **BELT))
    recording.save(folder / "run.npz")
    columns = {"t_s": recording.time}
    for group, name in (("box 1", "front"), ("box 2", "rear")):
        signal = sense(recording, sensor=name)
        columns |= {f"{group}/ax_g": signal.ax, f"{group}/ay_g": signal.ay}
    pd.DataFrame(columns).round(6).to_csv(folder / "two.csv", index=False)
    return folder


def mapped(folder, sensors):
    return written(folder / "mapping.yaml", yaml.safe_dump({"unit": "g", "sensors": sensors}))


GROUPS = {"front": {"group": "box 1"}, "rear": {"group": "box 2"}}
BY_AXES = {
    "front": {"axes": {"ay": "box 1/ay_g"}, "range": 30},
    "rear": {"axes": {"ay": "box 2/ay_g", "ax": "box 2/ax_g"}},
}


@pytest.mark.parametrize("sensors", [GROUPS, BY_AXES], ids=["groups", "axes"])
def test_each_sensor_is_compared_with_its_own_group(compared, sensors):
    recording, mapping = load_recording(compared / "run.npz"), load_mapping(mapped(compared, sensors))
    rms = {}
    for name in PLACES:
        record = read_sensor(compared / "two.csv", mapping.sensors[name])
        table = compare_with_sensor(recording.with_sensor(name), record).set_index("measure")
        assert abs(table.difference_pct.rms_g) < 1e-3
        rms[name] = table.sensor.rms_g
    assert abs(rms["front"] / rms["rear"] - 1) > 1e-2  # an exchange would be seen
    names = ["compare", compared / "run.npz", compared / "two.csv", "--mapping", compared / "mapping.yaml"]
    ended = run_command(*names, "--out", compared / "table.csv", "--overwrite")
    assert ended.code == 0 and "sensor front" in ended.out and "sensor rear" in ended.out
    assert (compared / "table.csv").read_text(encoding="utf-8").count("rms_g") == 2
    single = run_command(*names, "--sensor", "rear")
    assert single.code == 0 and "sensor rear" in single.out and "sensor front" not in single.out


@pytest.mark.parametrize(("sensors", "options", "words"), [
    (None, (), "has 2 sensors, front, rear, and the mapping names the columns of one"),
    (GROUPS | {"third": {}}, (), "those of front, rear, third"), (GROUPS, ("--sensor", "middle"), "sensor = 'middle'"),
    (GROUPS | {"rear": {"group": "box 3"}}, (), "no column's name begins with the group 'box 3'"),
    (GROUPS, ("--figure", "both.png"), "shows one sensor; name it with --sensor, front, rear"),
    ({"front": {"sensors": GROUPS}}, (), "must not be in the mapping of a sensor"), ({"front": 5}, (), "front = 5"),
])  # fmt: skip
def test_groups_that_do_not_fit_are_refused_in_one_sentence(compared, sensors, options, words):
    mapping = () if sensors is None else ("--mapping", mapped(compared, sensors))
    ended = run_command("compare", compared / "run.npz", compared / "two.csv", *mapping, *options)
    assert ended.code != 0 and words in ended.err and ended.err.count("\n") == 1
