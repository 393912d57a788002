"""What each departure changes: the shipped list is one that can be measured."""

from pathlib import Path

import pytest

from laboratory.studies.departures import Departures
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

FILE = Path(__file__).parents[2] / "config" / "departures.yaml"


@pytest.fixture
def study():
    return validated(Departures, read_yaml(FILE), FILE)


def test_every_departure_has_its_scenes(study, rig_path):
    """All of them are accepted on the shipped rig, one a speed and ring."""
    rig = load_rig(rig_path)
    for name, departure in study.departures.items():
        scenes = study.scenes(rig, departure)
        assert len(scenes) == len(study.speeds_rpm) * len(study.ring_radii_m), name
        assert any(scenes[key] != same for key, same in study.scenes(rig, type(departure)()).items())
