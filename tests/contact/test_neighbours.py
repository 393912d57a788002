"""No contact is missing from the neighbour lists, however long they are valid."""

import numpy as np
import pytest

from tests.conftest import LAWS
from trackdyn import Loop, TrackdynError
from trackdyn.model.arrays import OFFSET
from trackdyn.model.constants import SPROCKET


def distances(loop):
    """Return distances of arcs' centres from the sprocket's axis (2 p,), and of links from every wheel's (p, w); m."""
    model, state, work, (space, *_) = loop.arrays
    shoes = model.shoes
    height = 0.0 if space is None else state.plane.motion[OFFSET]

    def from_wheel(wheel, body, along):
        x = work.pin_x[body] + along * np.cos(state.angle[body])
        y = work.pin_y[body] + along * np.sin(state.angle[body])
        if space is None:
            return np.column_stack([x - model.wheels.x[wheel], y - model.wheels.y[wheel]])
        points = np.column_stack([x, y, np.full(len(x), height)])
        return (points @ space.relative[wheel].T - model.space.centre[wheel])[:, :2]

    arcs = np.hypot(*from_wheel(SPROCKET, shoes.arc_body, shoes.arc_x).T)
    links = np.empty(work.wheel_force.shape)
    for wheel in range(links.shape[1]):
        a, b = (from_wheel(wheel, shoes.link_body, end) for end in (shoes.link_start, shoes.link_end))
        along = np.clip(-np.sum(a * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
        links[:, wheel] = np.hypot(*(a + along[:, None] * (b - a)).T)
    return arcs, links


def missed(loop):
    """Count arcs and pairs of link and wheel that touch: those on no list, and the total."""
    model, candidates = loop.arrays.model, loop.arrays.work.candidates
    arcs, links = distances(loop)
    reached = arcs < model.tooth.addendum + model.tooth.arc_radius
    touching = (links < model.wheels.radius + model.wheels.half_thickness) & (model.wheels.present == 1)
    listed, listed_links = np.zeros(len(arcs), bool), np.zeros(links.shape, bool)
    listed[candidates.arc[: candidates.count[0]]] = True
    listed_links[tuple(candidates.link[: candidates.count[1]].T)] = True
    count = np.count_nonzero(reached) + np.count_nonzero(touching)
    return np.count_nonzero(reached & ~listed) + np.count_nonzero(touching & ~listed_links), count


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
        left_out, count = missed(loop)
        assert left_out == 0 and count > 10
