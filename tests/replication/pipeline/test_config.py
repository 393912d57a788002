"""A bad configuration is refused in one sentence that names file, field, value and remedy."""

import re
from pathlib import Path

import pytest
from pydantic import TypeAdapter
from snakemake.utils import update_config

from tests.conftest import refused, written
from trackdyn.inputs.validation import validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig import load_rig
from trackdyn.scene.rings import study_radii
from trackdyn_replication.pipeline.config import check_config, check_layers
from trackdyn_replication.study.settings import Studies, StudiesFile

BASE, QUICK = SHIPPED = ("config/config.yaml", "config/quick.yaml")
STUDIES = "config/studies.yaml"


@pytest.fixture
def data():
    return read_yaml(BASE)


def load(path):
    """A shipped configuration on top of the base, as Snakemake merges them."""
    data = read_yaml(BASE)
    update_config(data, read_yaml(path))
    return check_config(data, path)


def refusal(data):
    return refused(check_config, data, "mine.yaml", start="mine.yaml: ")


def test_a_rounded_speed_is_run_beside_the_speed_that_it_stands_for(data):
    _, rig, scenes = check_config(data, "mine.yaml")
    run = scenes["rounded/115rpm"]
    assert run.motor_rpm == pytest.approx(20.6 * rig.sprocket.transmission_ratio)
    assert run.with_(motor_rpm=115.0) == scenes["115rpm"].with_(frame_interval=0.0)
    data["records"]["speeds_rpm"] = [150, 210]
    assert not [name for name in check_config(data, "mine.yaml")[2] if name.startswith("rounded")]


@pytest.mark.parametrize("path", [*SHIPPED, "config/full.yaml"])
def test_shipped_configurations_are_valid(path):
    """The base is the paper's matrix."""
    config, rig, scenes = load(path)
    assert rig.model_dump() == load_rig(config.rig).model_dump()
    study = config.ring_study
    # every record also with the coarse tooth, some with a rounded speed, meshing with and without the ring
    records = 2 * len(config.records.speeds_rpm) + len(config.rounded_speeds)
    assert len(scenes) == records + 2 + len(study.speeds_rpm) * (len(study.radii_m) + study.without_ring)
    if path == BASE:
        assert config.records.speeds_rpm == [115, 150, 180, 210] and config.records.duration_s == 90
        assert study.radii_m == pytest.approx([0.303 + 0.001 * i for i in range(11)])
        assert sum(scene.ring_radius is None for scene in scenes.values()) == 1 + 4


def test_a_refusal_names_the_file_that_is_to_blame(tmp_path):
    text = Path(BASE).read_text(encoding="utf-8")
    base, mine = written(tmp_path / "base.yaml", text), written(tmp_path / "mine.yaml", "records: {ramp_s: 0}\n")
    refused(check_layers, [base, QUICK, mine], {}, update_config, start=f"{mine}: records.ramp_s = 0")
    written(base, text + "more: 1\n")
    refused(check_layers, [base, QUICK, mine], {}, update_config, start=f"{base}: more is not a known parameter")


@pytest.mark.parametrize("field", ["rig", "records", "meshing.step_s", "ring_study.radii_m"])
def test_a_missing_key_is_refused(data, field):
    *sections, name = field.split(".")
    del (data[sections[0]] if sections else data)[name]
    assert f"{field} is missing; add it" in refusal(data)


@pytest.mark.parametrize("section", ["records", "meshing", "ring_study"])
def test_too_large_a_step_is_refused_with_one_that_would_do(data, section):
    def ask(step):
        data[section] |= {"steps_s": [[0.313, step]]} if section == "ring_study" else {"step_s": step}

    ask(1e-3)
    sentence = refusal(data)
    assert section in sentence and "step = 0.001: too large for the " in sentence
    limit, such = map(float, re.search(r"at most (\S+) s, such as (\S+) s$", sentence).groups())
    assert 2e-5 < such <= 1.01 * limit < 1e-3
    ask(such)
    check_config(data, "mine.yaml")


def test_a_ring_takes_the_longest_step_that_is_allowed_up_to_its_radius(data):
    data["ring_study"]["steps_s"] = [[0.305, 1e-4], [0.309, 5e-5], [0.31, 4e-5]]
    _, _, scenes = check_config(data, "mine.yaml")
    for step, names in {1e-4: ("none", "0.303", "0.305"), 5e-5: ("0.306", "0.309"), 4e-5: ("0.31", "0.313")}.items():
        assert [scenes[f"ring/115rpm_{name}"].time_step for name in names] == [step] * len(names)


@pytest.mark.parametrize("rig", ["bench", "robot", "m113", "vehicle"])
def test_a_rig_alone_is_a_configuration(tmp_path, rig):
    """Nothing that the base states for its own rig is asked of another one, unless the file states it, too."""
    mine = written(tmp_path / "mine.yaml", f"rig: {rig}\n")
    config, loaded, scenes = check_layers([BASE, mine], {}, update_config)
    assert (config.sensor_files, config.synthetic, config.default_studies) == ([], None, [])
    assert config.ring_study.radii_m == study_radii(loaded) and config.records.ring_radius_m == loaded.ring_radius
    assert all(scene.rig is loaded and scene.step is None for scene in scenes.values())
    radius = config.ring_study.radii_m[3]
    written(mine, f"rig: {rig}\nring_study: {{radii_m: [{radius}]}}\ndefault_studies: [trade]\n")
    for files, stated in (([BASE, mine], {}), ([BASE], {"rig": rig, "ring_study": {"radii_m": [radius]}})):
        config = check_layers(files, stated, update_config)[0]
        assert (config.ring_study.radii_m, config.sensor_csv) == ([radius], None)


@pytest.mark.parametrize("rig", ["bench", "robot", "m113", "vehicle"])
def test_records_last_two_turns_of_the_loop_of_every_rig(tmp_path, rig):
    """Also in a quick run; other codes have models only of the article's rig."""
    mine = written(tmp_path / "mine.yaml", f"rig: {rig}\nrecords: {{duration_s: 1}}\nmeshing: {{duration_s: 1}}\n")
    config, loaded, scenes = check_layers([BASE, QUICK, mine], {}, update_config)
    assert config.peers is None and check_layers([BASE, QUICK], {}, update_config)[0].peers
    assert not config.is_paper and check_layers([BASE, QUICK], {}, update_config)[0].is_paper
    # 60 s times transmission over motor speed, times pitches over teeth
    period = 60 * loaded.sprocket.transmission_ratio / 115 * loaded.chain.pitches / loaded.sprocket.teeth
    assert 2 * period <= scenes["115rpm"].duration == config.records.duration_s < 2 * period + 1
    assert 2.1 * period <= scenes["meshing/ring"].duration == config.meshing.duration_s < 2.1 * period + 1
    assert all(run.duration * run.periods.loop_hz >= 2 for name, run in scenes.items() if not name.startswith("ring/"))


def test_a_quick_run_says_how_it_is_shorter():
    assert load(BASE)[0].shorter == ""
    text = "Records last 16 s, the paper's 90 s. Radii of the ring study: 3; nothing is judged by fewer than 5."
    assert load(QUICK)[0].shorter == text
    (data := read_yaml(BASE))["records"]["speeds_rpm"] = [165]
    data["sensor_csv"] = None
    assert check_config(data, "mine.yaml")[0].shorter == "Records at 165 rpm alone show no trend with the speed."


def test_sensor_files_and_their_mapping_must_be_there(data, tmp_path):
    data["sensor_csv"] = str(tmp_path / "{rpm}.csv")
    assert f"{tmp_path / '115.csv'} does not exist; every speed" in refusal(data)
    data |= {"sensor_csv": "data/synthetic/{rpm}rpm.csv", "sensor_mapping": str(tmp_path / "logger.yaml")}
    assert "logger.yaml: no such file" in refusal(data)
    written(tmp_path / "logger.yaml", "unit: inch/s2\n")
    assert "logger.yaml: unit = 'inch/s2':" in refusal(data)
    written(tmp_path / "logger.yaml", "axes: {ay: -ax}\n")
    check_config(data, "mine.yaml")


def test_studies_are_those_of_the_file_that_is_named():
    named = TypeAdapter(StudiesFile).validate_python
    assert named(STUDIES) == validated(Studies, read_yaml(STUDIES), "studies.yaml")
    refused(named, "nowhere.yaml", words=["nowhere.yaml: no such file"])


@pytest.mark.parametrize(("study", "field", "value", "message"), [
    ("trade", "kept_apart", [[115, 0.308]], "kept_apart = [115.0, 0.308]: statistics.scenes holds"),
    ("trade", "statistics", {"scenes": [[210, 0.308]], "steps_s": {"rk4": [1e-4]}, "coarse_steps_s": {},
                             "loop_turns": 1, "loop_turns_without_ring": 1}, "steps_s: needs at least two steps"),
    ("trade", "kept_apart", [[210, -0.308]], "trade.kept_apart.0.1 = -0.308:"),
    ("extremes", "short_runs", 0, "extremes.short_runs = 0:"),
    ("extremes", "bodies", [7], "extremes.bodies.0 = 7:"),
    ("extremes", "depth_m", [1], "extremes.depth_m is not a known parameter"),
])  # fmt: skip
def test_a_meaningless_setting_of_a_study_is_refused(study, field, value, message):
    (data := read_yaml(STUDIES))[study][field] = value
    refused(validated, Studies, data, "mine.yaml", words=[message], start="mine.yaml: ")
