"""A recording that needs no kernel, a folder of odd files, and the command within this process."""

import pytest

from tests.conftest import BELT
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording


@pytest.fixture(scope="session")
def belt_file(rig, tmp_path_factory):
    path = tmp_path_factory.mktemp("belt") / "short.npz"
    belt_recording(Scene(rig, 115.0, **BELT, duration=0.5)).save(path)
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch, belt_file):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.npz").mkdir()
    (tmp_path / "short.npz").write_bytes(belt_file.read_bytes())
    (tmp_path / "plain").write_bytes(b"text\n")
    return tmp_path
