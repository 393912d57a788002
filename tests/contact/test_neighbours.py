"""No contact is missing from the neighbour lists, however long they are valid."""

import numpy as np
import pytest

from tests.conftest import LAWS
from trackdyn import Loop, TrackdynError
from trackdyn.model.arrays import OFFSET
from trackdyn.model.constants import SPROCKET


def contacts(loop):
    """Return arcs, and pairs of link and wheel, that touch; and those of them that are on no list."""
    model, state, work, (space, *_) = loop.arrays
    shoes, candidates = model.shoes, work.candidates
    height = 0.0 if space is None else state.plane.motion[OFFSET]

    def from_wheel(wheel, body, along):
        x = work.pin_x[body] + along * np.cos(state.angle[body])
        y = work.pin_y[body] + along * np.sin(state.angle[body])
        if space is None:
            return np.column_stack([x - model.wheels.x[wheel], y - model.wheels.y[wheel]])
        points = np.column_stack([x, y, np.full(len(x), height)])
        return (points @ space.relative[wheel].T - model.space.centre[wheel])[:, :2]

    arcs = np.hypot(*from_wheel(SPROCKET, shoes.arc_body, shoes.arc_x).T)
    touching = {*np.flatnonzero(arcs < model.tooth.addendum + model.tooth.arc_radius)}
    for wheel in np.flatnonzero(model.wheels.present):
        a, b = (from_wheel(wheel, shoes.link_body, end) for end in (shoes.link_start, shoes.link_end))
        along = np.clip(-np.sum(a * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
        distance = np.hypot(*(a + along[:, None] * (b - a)).T)
        reach = model.wheels.radius[wheel] + model.wheels.half_thickness
        touching |= {(link, wheel) for link in np.flatnonzero(distance < reach)}
    listed = {*candidates.arc[: candidates.count[0]], *map(tuple, candidates.link[: candidates.count[1]])}
    return touching, touching - listed


@pytest.mark.parametrize("fields", [
    {"motor_rpm": 210.0, "ring_radius": None}, {"motor_rpm": 10000.0, "ring_radius": 0.308, "step": 1e-5},
    {"motor_rpm": 210.0, "ring_radius": 0.308, "tension": "sprung"},
    {"motor_rpm": 210.0, "ring_radius": 0.308, "space": "spatial", **LAWS},
], ids=lambda fields: "-".join(map(str, fields.values())))  # fmt: skip
def test_no_contact_is_missed(make_scene, fields):
    loop = Loop(make_scene(**fields))
    rng = np.random.default_rng(0)
    for _ in range(12):
        try:
            loop.step(int(rng.integers(100, 600)))  # lists are made at its first step
        except TrackdynError:
            break  # 10,000 rev/min tears the loop off its wheels in the end
        touching, missed = contacts(loop)
        assert len(touching) > 10 and not missed
