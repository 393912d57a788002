"""Studies in parts: nothing is lost and nothing is run twice."""

from pathlib import Path

import pytest

from replication.study import settings
from replication.study.extremes import random_scenes, run
from replication.study.settings import Studies, measured_scenes, promised_scenes
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

FILE = Path(__file__).parents[3] / "config" / "studies.yaml"


@pytest.fixture(scope="module")
def studies():
    return validated(Studies, read_yaml(FILE), str(FILE))


@pytest.mark.parametrize("form", ["short", "full"])
def test_every_scene_of_the_trade_is_one_part(studies, form):
    form = getattr(studies.trade, form)
    parts = measured_scenes(form)
    assert [scene for part in parts.values() for scene in part.scenes] == form.statistics.scenes
    assert list(promised_scenes(form).values()) == form.kept_apart
    assert all(" " not in name and "/" not in name for name in (*parts, *promised_scenes(form)))


def test_random_scenes_are_split_into_parts_of_one_drawing(studies, rig, monkeypatch):
    form, limit = studies.extremes.short, 5
    for module in (run, settings):
        monkeypatch.setattr(module, "RANDOM_SCENES", limit, raising=False)
    monkeypatch.setattr(random_scenes, "run_random_scene", lambda rig, drawn: drawn)
    parts = [part for part in run.parts_of(form) if part.startswith("random_")]
    assert len(parts) > 1
    whole = list(random_scenes.random_scenes(rig, form.random_scenes))
    split = [
        list(random_scenes.random_scenes(rig, form.random_scenes, part=k, parts=len(parts))) for k in range(len(parts))
    ]
    assert [scene for part in split for scene in part] == whole
    assert max(map(len, split)) <= limit


@pytest.mark.parametrize("form", ["short", "full"])
def test_parts_have_names_of_their_own(studies, form):
    parts = run.parts_of(getattr(studies.extremes, form))
    assert len(set(parts)) == len(parts)
