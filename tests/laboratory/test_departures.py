"""What each departure changes: the shipped list is one that can be measured."""

import shutil
from pathlib import Path

import pytest

import trackdyn
from laboratory.studies.departures import Departures, Lines
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

FILE = Path(__file__).parents[2] / "config" / "departures.yaml"


@pytest.fixture
def study():
    return validated(Departures, read_yaml(FILE), FILE)


@pytest.fixture
def package(tmp_path):
    copy = tmp_path / "trackdyn"
    shutil.copytree(Path(trackdyn.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def test_every_departure_has_its_scenes(study, default_rig_path):
    """All of them are accepted on the shipped rig, one a speed and ring."""
    rig = load_rig(default_rig_path)
    for name, departure in study.departures.items():
        scenes = study.scenes(rig, departure)
        assert len(scenes) == len(study.speeds_rpm) * len(study.ring_radii_m), name
        assert departure.lines is not None or any(
            scenes[key] != same for key, same in study.scenes(rig, type(departure)()).items()
        )


def test_lines_are_added_behind_a_line_that_stands_once(study, package):
    changed = [departure.lines for departure in study.departures.values() if departure.lines is not None]
    assert changed
    for lines in changed:
        file = package / lines.file
        before = file.read_text(encoding="utf-8")
        lines.apply(package)
        after = file.read_text(encoding="utf-8")
        assert len(after.splitlines()) == len(before.splitlines()) + len(lines.add.strip().splitlines())
        compile(after, str(file), "exec")
        file.write_text(before, encoding="utf-8")
    with pytest.raises(InputError, match="must stand there once"):
        Lines(file="contact/loads.py", behind="no such line", add="pass").apply(package)
