"""Recordings as tables: the signal of a sensor comes back from the file, and a file names its origin."""

from pathlib import Path

import numpy as np
import pytest

import trackdyn
from tests.conftest import BELT, made_recording, refused, run_command, written
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.fieldtest.sensor_mapping import SensorMapping
from trackdyn.measure.export import contact_table, export
from trackdyn.measure.sensor import sense
from trackdyn.model.arrays import CONTACT_INTERVAL
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import load_recording

RNG = np.random.default_rng(4)
SAMPLES, PITCHES = 3000, 3


@pytest.fixture
def recording(make_scene):
    """Noise in place of motion and forces; the sensor's range cuts some of it."""
    scene, log = make_scene(115.0, duration=3.0), np.zeros(3, CONTACT_INTERVAL)
    rows = [(4, 1, 2, 1.5, 2.0), (1, 2, 0, 1.4, 2.4), (1, 2, 0, 0.5, 0.6)]
    log[["pitch", "side", "groove", "start_s", "end_s"]] = rows
    return made_recording(
        scene, np.arange(1, SAMPLES + 1) / 1000, RNG.normal(0, 1e3, (SAMPLES, PITCHES, 3)), begin=0.5,
        mean=RNG.normal(0, 90, (SAMPLES, 1, 3)), area=RNG.integers(0, 10, (SAMPLES, PITCHES, 2), np.int8),
        groove=RNG.integers(0, 14, (SAMPLES, PITCHES, 2), np.int8), contact_log=log,
        wheel_rate=np.full((SAMPLES, 1 + len(scene.rig.wheels)), scene.sprocket_rate),
    )  # fmt: skip


@pytest.mark.parametrize("pitches", [(), (2, 3)])
def test_a_sensors_axes_come_back_from_the_file(recording, tmp_path, pitches):
    signal = sense(recording)
    assert signal.clipped > 0
    export(recording, tmp_path / "run.csv", pitches=pitches)
    record = read_sensor(tmp_path / "run.csv")
    for name in ("ax", "ay"):  # 12 digits are written
        np.testing.assert_allclose(getattr(record, name), getattr(signal, name), rtol=1e-11, atol=0)
    assert record.rate == 1000 and record.synthetic and record.clipped > 0


def test_columns_are_the_recorded_arrays(recording):
    table = recording.to_frame()
    np.testing.assert_array_equal(table[["t_s", "ax_g", "ay_g"]], sense(recording).to_frame())
    for k in range(PITCHES):
        sides = [f"pitch_{k + 1}_{side}_n" for side in ("left", "right", "ring")]
        np.testing.assert_array_equal(table[sides], recording.force[:, k])
        np.testing.assert_array_equal(table[f"pitch_{k + 1}_right_area"], recording.area[:, k, 1])
        np.testing.assert_array_equal(table[f"pitch_{k + 1}_left_groove"], recording.groove[:, k, 0])
    assert list(recording.to_frame(2)) == list(recording.to_frame([2])) == list(recording.to_frame(np.array([2])))
    refused(recording.to_frame, [2, 30], words=["pitch = 30: was not recorded; the recording has 1, 2, 3"])
    refused(recording.to_frame, "2", words=["pitch = '2'"])


def test_every_sensor_has_its_columns(rig, tmp_path):
    first = rig.first_sensor
    two = rig.model_copy(update={"sensors": {"front": first, "rear": first.model_copy(update={"pitch": 9})}})
    recording = belt_recording(Scene(two, 115.0, **BELT, duration=4.0))
    export(recording, tmp_path / "two.csv")
    export(recording, tmp_path / "rear.csv", sensor="rear")
    expected = sense(recording, sensor="rear").ay
    assert abs(expected - sense(recording).ay).max() > 0.1
    for name, mapping in (("two.csv", SensorMapping(group="rear")), ("rear.csv", None)):
        np.testing.assert_allclose(read_sensor(tmp_path / name, mapping).ay, expected, rtol=1e-11, atol=1e-15)


def test_a_matlab_file_has_a_variable_a_column(recording, tmp_path):
    from scipy.io import loadmat

    table, _ = (export(recording, tmp_path / name, pitches=[1]) for name in ("run.mat", "again.mat"))
    assert (tmp_path / "run.mat").read_bytes() == (tmp_path / "again.mat").read_bytes()
    loaded = loadmat(tmp_path / "run.mat")
    for name in table:
        assert name.isidentifier() and len(name) <= 63
        np.testing.assert_array_equal(loaded[name][:, 0], table[name])
    assert str(loaded["origin"][0]).endswith(recording.origin)


def test_contacts_have_a_row_each(recording, tmp_path):
    """Pitches count from 0 in the log; a contact that the beginning of the record cuts is none."""
    table = contact_table(recording)
    assert table["pitch"].tolist() == [2, 5] and table["side"].tolist() == ["ring", "right"]
    turn = 60 * recording.scene.rig.sprocket.transmission_ratio / 115
    np.testing.assert_allclose(table["share_pct"], [100 / turn, 50 / turn], rtol=1e-9)
    np.testing.assert_allclose(table[["start_s", "end_s"]], [[0.9, 1.9], [1.0, 1.5]], rtol=1e-9)
    assert export(recording, tmp_path / "contacts.csv", pitches=5, contacts=True)["groove"].tolist() == [2]
    refused(contact_table, recording, [36], words=["pitch = 36", "1 to 35"])


def test_a_file_names_program_rig_and_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(Path("mine.yaml"), "like: bench\n")
    for path, changes, name in (("mine.yaml", {}, "mine"), ("bench", {"idler__inertia": 0.5}, "bench changed")):
        belt = belt_recording(Scene(load_rig(path).changed(**changes) if changes else load_rig(path), 99.0, **BELT))
        belt.save("run.npz")
        assert load_recording("run.npz").scene.rig.name == name
        assert run_command("export", "run.npz", "run.csv", "--overwrite").code == 0
        first = Path("run.csv").read_text(encoding="utf-8").splitlines()[0]
        assert first.startswith("# synthetic") and f"trackdyn {trackdyn.__version__}" in first
        assert f"rig {name}: " in first and "99 rev/min, no ring" in first and belt.meta["sources"] in first
