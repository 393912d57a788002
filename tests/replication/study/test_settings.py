"""The settings of the long studies: shipped ones are valid, meaningless ones are refused in one sentence."""

import pytest
from pydantic import TypeAdapter

from tests.conftest import ROOT, refused
from trackdyn.inputs.validation import validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn_replication.study.settings import Studies, StudiesFile

FILE = ROOT / "config" / "studies.yaml"
TURNS = {"loop_turns": 1, "loop_turns_without_ring": 1}
ONE_METHOD = {"scenes": [[210, 0.308]], "steps_s": {"rk4": [1e-4]}, "coarse_steps_s": {}} | TURNS


def test_a_configuration_names_the_file_and_holds_what_stands_there():
    assert TypeAdapter(StudiesFile).validate_python(str(FILE)) == validated(Studies, read_yaml(FILE), "studies.yaml")
    refused(TypeAdapter(StudiesFile).validate_python, "nowhere.yaml", words=["nowhere.yaml: no such file"])


@pytest.mark.parametrize(("study", "field", "value", "message"), [
    ("trade", "kept_apart", [[115, 0.308]], "kept_apart = [115.0, 0.308]: statistics.scenes holds"),
    ("trade", "statistics", ONE_METHOD, "steps_s: needs at least two steps"),
    ("trade", "kept_apart", [[210, -0.308]], "trade.kept_apart.0.1 = -0.308:"),
    ("extremes", "short_runs", 0, "extremes.short_runs = 0:"),
    ("extremes", "bodies", [7], "extremes.bodies.0 = 7:"),
    ("extremes", "depth_m", [1], "extremes.depth_m is not a known parameter"),
])  # fmt: skip
def test_a_meaningless_setting_is_refused(study, field, value, message):
    (data := read_yaml(FILE))[study][field] = value
    refused(validated, Studies, data, "mine.yaml", words=[message], start="mine.yaml: ")
