"""A configuration is refused in one sentence before anything runs."""

from pathlib import Path

import pytest
from sentences import HUGE, ROOT, one_sentence

from replication.pipeline.config import RIG_FIELDS, check_config, check_layers
from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig_file import shipped_rigs

SETTINGS = [
    ("results", "", "results = ''", "the name of a folder"),
    ("results", "~/x", "results = '~/x'", "in letters, digits and"),
    ("results", "r$(touch$IFS'x')", "results = ", "in letters, digits and"),
    ("results", "x{run}", "results = 'x{run}'"),
    ("results", "README.md", "README.md is a file"),
    ("results", "x" * 300, "the name of a folder"),
    ("results", 5, "valid string"),
    ("records.duration_s", -90, "records.duration_s = -90", "greater than 0"),
    ("records.duration_s", "long", "valid number"),
    (
        "ring_study.steps_s",
        [[0.309, 5e-5], [0.305, 1e-4]],
        "0.305 comes after 0.309; give rising",
    ),
    ("records.speeds_rpm", [], "records.speeds_rpm", "at least 1 item"),
    ("records", [1, 2], "records = [1, 2]", "a mapping of names to values"),
    ("records.lead_in_s", True, "records.lead_in_s = True"),
    ("sensor_is_synthetic", "yes", "sensor_is_synthetic = 'yes'"),
    (
        "records.speeds_rpm",
        [115, 150, 150],
        "records.speeds_rpm = [115.0, 150.0, 150.0]: 150 occurs twice; give rising",
    ),
    ("ring_study.speeds_rpm", [150, 115], "ring_study.speeds_rpm = [150.0, 115.0]: 115 comes after 150; give rising"),
    ("ring_study.radii_m", [0.3080, 0.30801], "ring_study: two runs would share the name ring/115rpm_0.308"),
    ("ring_study.radii_m", [0.303, 0.5], "ring_study (run ring/115rpm_0.5)", "ring_radius = 0.5", "or no ring"),
    ("records.ring_radius_m", 0.5, "records (run 115rpm)", "ring_radius = 0.5", "or no ring"),
    ("meshing.durations_s", 3, "meshing.durations_s is not a known parameter; remove it or correct its spelling"),
    ("records.speeds_rpm", [HUGE], "records.speeds_rpm.0"),
    ("records.speeds_rpm", [1e9], "records.speeds_rpm.0 = 1000000000.0", "less than 100000"),
    ("records.duration_s", 1e300, "records (run 115rpm): scene: duration = 1e+300", "and 36000 s"),
    ("stop_rule.longest_turns", 10**30, "stop_rule.longest_turns", "less than or equal to 1000000"),
    ("ring_study.without_ring", 5, "ring_study.without_ring = 5"),
    ("peers.steps_s", [1e-4, 1e-4], "peers: steps_s = [0.0001, 0.0001]", "occurs twice"),
    ("peers.steps_s", [1e-4, 3e-5], "peers: scene: step = 3e-05", "must divide"),
    ("peers.readings", ["motor", "motor"], "peers: readings", "occurs twice"),
    ("peers.speed_rpm", 9e4, "peers: scene: motor_rpm = 501300.0"),
    ("fidelity.speeds_rpm", [210, 115], "fidelity.speeds_rpm", "give rising values"),
    ("fidelity.settings", ["preset=best"], "fidelity.settings", "preset=paper"),
    ("sensor_csv", "nowhere/{rpm}.csv", "nowhere/115.csv does not exist"),
    ("sensor_csv", "{0.__class__}", "the only field in braces is {rpm}"),
    ("sensor_csv", "/dev/zero", "it names one file for several speeds; write {rpm} where the motor speed belongs"),
    ("rig", "/dev/zero", "no plain file"),
    ("rig", "absent.yaml", "absent.yaml: no such file"),
    ("sensor_csv", "d{{x}}/{rpm}.csv", "sensor_csv = 'd{x}/115.csv': holds a brace; rename the file or folder"),
    ("sensor_mapping", "{a}.yaml", "sensor_mapping = '{a}.yaml': holds a brace"),
    ("studies", "absent.yaml", "absent.yaml: no such file"),
]


@pytest.mark.parametrize("row", SETTINGS, ids=lambda row: f"{row[0]}={shown(row[1])}")
def test_a_configuration_is_refused_before_anything_runs(monkeypatch, row):
    key, value, *words = row
    monkeypatch.chdir(ROOT)
    data = read_yaml("config/config.yaml")
    *sections, field = key.split(".")
    section = data
    for name in sections:
        section = section.setdefault(name, {})
    section[field] = value
    with pytest.raises(InputError) as caught:
        check_config(data, "mine.yaml")
    one_sentence(caught, *words)


def test_files_whose_names_hold_braces_are_refused(monkeypatch, tmp_path):
    """Those of a rig and of what it is like, and configurations; in names of files that are there."""
    monkeypatch.chdir(tmp_path)
    base, rig = read_yaml(ROOT / "config/config.yaml"), shipped_rigs()["bench"].read_text(encoding="utf-8")
    for name in ("a{b}.yaml", "base}.yaml"):
        Path(name).write_text(rig, encoding="utf-8")
    Path("mine.yaml").write_text("like: base}.yaml\n", encoding="utf-8")
    for stated, words in (
        ({"rig": "a{b}.yaml"}, "rig = 'a{b}.yaml': holds a brace"),
        ({"rig": "mine.yaml"}, "rig = 'base}.yaml': holds a brace"),
    ):
        data = base | RIG_FIELDS | {"article": None, "studies": str(ROOT / base["studies"])}
        data |= {name: base[name] | RIG_FIELDS[name] for name in ("records", "meshing", "ring_study")} | stated
        with pytest.raises(InputError) as caught:
            check_config(data, "mine.yaml")
        one_sentence(caught, words)
    with pytest.raises(InputError, match=r"^--configfile = '\{x\}\.yaml': holds a brace"):
        check_layers(["{x}.yaml"], {}, dict.update)


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    data = read_yaml("config/config.yaml") | {"results": "mine/new"}
    monkeypatch.setattr(
        "replication.pipeline.config.os.access", lambda path, mode: False
    )  # root may write anywhere else
    with pytest.raises(InputError) as caught:
        check_config(data, "mine.yaml")
    one_sentence(caught, "results = 'mine/new'", "is not writable; choose another folder")
