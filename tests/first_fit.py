"""Fixtures of folders whose tests still need the first fit: its viscous bushings, pre-tension and step bounds."""

import pytest

from tests.conftest import CONFIG, driven, scenes_of
from trackdyn.parameters.rig import load_rig


@pytest.fixture(scope="session")
def rig():
    return load_rig(CONFIG / "rigs" / "first_fit.yaml")


@pytest.fixture(scope="session")
def make_scene(rig):
    return scenes_of(rig)


@pytest.fixture(scope="session")
def driven_loop(make_scene):
    return driven(make_scene)
