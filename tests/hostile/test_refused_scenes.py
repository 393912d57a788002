"""A scene that cannot be is refused in one sentence: its fields, and rigs that lead nowhere. No kernel is compiled."""

import json
from fractions import Fraction

import numpy as np
import pytest
from sentences import BELT, HUGE, LONGER, NO_NUMBERS, NUMBER, one_sentence

from tests.conftest import RIG
from trackdyn.inputs.errors import InputError, shown
from trackdyn.rig.rig import load_rig
from trackdyn.scene.choices import CHOICES
from trackdyn.scene.scene import Scene

NO_CHOICES = (
    np.array(["a", "b"]), None, np.timedelta64(1), np.ma.array(["free"], mask=[True]), np.ma.masked, ["free"], b"free",
    LONGER,
)  # fmt: skip
SCENES = [
    *[({"motor_rpm": value}, "motor_rpm", NUMBER) for value in NO_NUMBERS],
    *[
        ({name: HUGE}, name, NUMBER)
        for name in ("ring_radius", "duration", "lead_in", "ramp", "step", "frame_interval")
    ],
    *[({name: "long"}, f"{name} = 'long'", NUMBER) for name in ("ring_radius", "duration", "step")],
    ({"motor_rpm": -1}, "motor_rpm = -1.0", "between 0 and 100000 rev/min"),
    (
        {"ring_radius": 1e300},
        "ring_radius = 1e+300",
        "between {:.4f} m (touches no link) and {:.4f} m".format(*Scene.ring_range(load_rig(RIG))),
    ),
    ({"ring_radius": -0.3}, "ring_radius = -0.3", "must be a radius in m, or null"),
    ({"duration": 1e-300}, "duration = 1e-300", "between 0.001 and"),
    ({"lead_in": 1e9}, "lead_in", "and 36000 s"),
    ({"ramp": 5e-324}, "ramp = 5e-324", "between 1e-06 and"),
    ({"step": 1e-12}, "step = 1e-12", "at least 1e-08 s"),
    ({"step": 0.0}, "step = 0.0: must divide", "such as 5e-05"),
    ({"step": 1e-8, "duration": 36000}, "step = 1e-08", "3.6e+12 steps"),
    ({"frame_interval": 1e308}, "frame_interval = 1e+308", "no longer than the duration"),
    ({"frame_interval": -0.1}, "frame_interval = -0.1", "a multiple"),
    *[
        ({"pitches": value}, "pitches", "a list of whole numbers")
        for value in ("12", 3, None, LONGER, [1.5], [True], {1, 2}, [[1]], iter([1]))
    ],
    ({"pitches": [HUGE]}, "pitches", "between 1 and 35"),
    ({"pitches": [36]}, "pitches = 36", "between 1 and 35"),
    *[
        ({"contact_log": value}, "contact_log", "True or False")
        for value in (1, "yes", None, b"1", np.array([True, False]))
    ],
    *[({name: value}, f"{name} = ", ": use ") for name in CHOICES for value in NO_CHOICES],
    ({"motor_rpm": np.timedelta64(5, "s")}, "motor_rpm", NUMBER),
    ({"motor_rpm": np.ma.array(115.0, mask=True), "chain": "x" * 2000}, "scene: "),
    ({"rig": None}, "rig = None", "an instance of Rig"),
    ({"rig": "trackdyn/rigs/paper.yaml"}, "rig = 'trackdyn/rigs/paper.yaml'", "an instance of Rig"),
    ({"rig": Scene}, "rig", "an instance of Rig"),
    *[({name: 3}, f"{name} is not a known parameter", "") for name in ("speed", "solver", "joint", "tolerance")],
]


@pytest.mark.parametrize("row", SCENES, ids=lambda row: shown(row[0])[:40])  # without the address of an object
def test_a_scene_is_refused(rig, row):
    fields, *words = row
    with pytest.raises(InputError) as caught:
        Scene(**{"rig": rig, "motor_rpm": 115.0} | fields)
    assert one_sentence(caught, *words).startswith("scene: ")


@pytest.mark.parametrize(
    "value", [150, np.float32(150), np.int64(150), np.array(150.0), np.array(150), Fraction(300, 2)], ids=shown
)
def test_a_number_is_a_number_whichever_library_it_comes_from(rig, value):
    """Scenes of equal numbers have the same description."""
    described = Scene(rig, value, **BELT, pitches=()).describe()
    assert json.dumps(described) == json.dumps(Scene(rig, 150.0, **BELT).describe())
    assert type(Scene(rig, 150.0, **BELT | {"chain": np.str_("belt")}).chain) is str
    assert Scene(rig, 115.0, pitches=np.array([1, 2]), contact_log=np.bool_(True)).describe()["pitches"] == [1, 2]
