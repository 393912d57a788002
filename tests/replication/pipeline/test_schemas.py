"""Schemas for editors are valid; every shipped YAML names its schema and keeps to it."""

import json
import os
import re
from copy import deepcopy
from pathlib import Path

import jsonschema
import pytest

from laboratory.schemas import EVERY, FOLDER
from replication.pipeline.schemas import schema
from trackdyn.inputs.yaml_file import read_yaml

ROOT = Path(__file__).parents[3]
WHOLE_RIGS = [ROOT / "trackdyn" / "rigs" / f"{name}.yaml" for name in ("paper", "parts")]  # others are like one
FILES = sorted([*(ROOT / "config").rglob("*.yaml"), *(ROOT / "tests" / "workflow").rglob("*.yaml"), *WHOLE_RIGS])
LINE = re.compile(r"# yaml-language-server: \$schema=(\S+)")


def named(path):
    """Name of the schema in the first line of a file."""
    header = LINE.match(path.read_text(encoding="utf-8"))
    assert header, f"{path.name}: begin it with # yaml-language-server: $schema=..."
    schema_path = Path(os.path.normpath(path.parent / header[1]))
    assert schema_path.parent == FOLDER
    return schema_path.name.removesuffix(".schema.json")


def errors(data, name):
    return [error.json_path for error in jsonschema.Draft202012Validator(schema(name, EVERY[name])).iter_errors(data)]


@pytest.mark.parametrize("name", EVERY)
def test_a_schema_holds_what_editors_know(name):
    data = schema(name, EVERY[name])
    jsonschema.Draft202012Validator.check_schema(data)
    assert not re.search(r'"(gt|ge|lt|le)":', json.dumps(data)), "a bound that no editor knows"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_shipped_file_keeps_to_its_schema(path):
    assert errors(read_yaml(path), named(path)) == []


def changed(path, keys, value):
    data = deepcopy(read_yaml(ROOT / path))
    section = data
    for key in keys[:-1]:
        section = section[key]
    if value is None:
        del section[keys[-1]]
    else:
        section[keys[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "keys", "value", "where"),
    [
        ("trackdyn/rigs/paper.yaml", ("chain", "link_mass", "unit"), "g", "$.chain.link_mass.unit"),
        ("trackdyn/rigs/paper.yaml", ("chain", "link_mass", "value"), -1, "$.chain.link_mass.value"),
        ("trackdyn/rigs/paper.yaml", ("chain", "link_mass", "source"), None, "$.chain.link_mass"),
        ("trackdyn/rigs/paper.yaml", ("chain", "link_mass"), 10.0, "$.chain.link_mass"),
        ("trackdyn/rigs/paper.yaml", ("chain", "link_mass", "low"), None, "$.chain.link_mass"),
        ("config/quick.yaml", ("recrods",), {}, "$"),
        ("config/quick.yaml", ("studies",), {"trade": 1}, "$.studies"),
        ("config/studies.yaml", ("trade", "promised"), None, "$.trade"),
    ],
)
def test_a_mistake_is_seen(path, keys, value, where):
    assert errors(changed(path, keys, value), named(ROOT / path)) == [where]


def test_a_mapping_of_a_sensor_is_covered():
    assert errors({"unit": "m/s2", "axes": {"ay": "-channel 3"}, "from": 1.5}, "mapping") == []
    assert errors({"unit": "furlong"}, "mapping") == ["$.unit"]
