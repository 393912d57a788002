"""Fixtures of folders whose tests need viscous bushings and drag, on a rig that does not move with the default one."""

from pathlib import Path

import pytest

from tests.conftest import driven, scenes_of
from trackdyn.rig.rig import load_rig

VISCOUS = Path(__file__).with_name("viscous.yaml")


@pytest.fixture(scope="session")
def rig_path():
    return VISCOUS


@pytest.fixture(scope="session")
def rig():
    return load_rig(VISCOUS)


@pytest.fixture(scope="session")
def make_scene(rig):
    return scenes_of(rig)


@pytest.fixture(scope="session")
def driven_loop(make_scene):
    return driven(make_scene)
