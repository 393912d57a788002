"""The law of wear: removed volume is work of friction over an energy density (Fleischer), and where friction works.

Archard's law with a constant coefficient of friction is the same: the energy density is ``mu H / K``.

A running loop goes on for a turn of the sprocket, every groove visited once, with a sample a step. The account of
sliding (`Recording.sliding`) says what friction did in each area in each step; the contacts at the beginning of the
step say where. The work of an area is divided among the contacts in it by their own friction, force times coefficient
times slip, so that the sum over the contour is the account's to rounding.
"""

from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from laboratory.wear.contour import ARC_NODES, Contour
from trackdyn.contact.laws import friction_coefficient
from trackdyn.model.arrays import BUSHING_LOSS
from trackdyn.parameters.quantities import FROM_FILE, Quantity
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Section, validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.simulation.loop import Loop

DEFAULT = Path(__file__).with_name("coefficients.yaml")
CHUNK = 2000  # steps
AREAS = 10  # of the grooves that wear
EnergyDensity = Annotated[float, Quantity("J/m3", gt=0)]


class Coefficients(Section):
    """Energy densities of the parts that wear (J/m3), the area of a bushing that does (m2), and the standard deviation
    of the point on a groove at which connectors touch (m): the model's connectors are alike, those of a chain are not.
    """

    tooth: EnergyDensity
    arc: EnergyDensity
    ring: EnergyDensity
    bushing: EnergyDensity
    bushing_area: Annotated[float, Quantity("m2", gt=0)]
    scatter: Annotated[float, Quantity("m", ge=0, le=0.01)]


def load_coefficients(path: Path | str = DEFAULT) -> Coefficients:
    """Read and validate a file of wear coefficients, each with value, unit, kind and source."""
    return validated(Coefficients, read_yaml(path), str(path), "add it with value, unit, kind and source", FROM_FILE)


def depth(work, energy_density: float, area):
    """Return the depth of wear, m, of an area (m2) for friction work (J) and energy density (J/m3)."""
    return work / (energy_density * area)


class Worked(NamedTuple):
    """Work of friction over a stretch, J."""

    flanks: tuple[np.ndarray, np.ndarray]  # by node of left and right flank, over all grooves
    arcs: np.ndarray  # (2, ARC_NODES) of all left and all right arcs, over the angle from the connector's own x axis
    areas: np.ndarray  # (10,) by area, of the account of sliding
    ring: float  # of the links on the ring
    bushing: float  # lost in all bushings
    distance: float  # what the chain ran, m
    estimate: float  # sum over the teeth by the law of friction alone, without the account


class Depths:
    """Indices of the state of a worn rig: depths in m, and the distance that the chain ran in m.

    ``ring`` and ``bushing`` are single depths, ``arcs`` those of left and right arc over the angle, ``flanks`` those
    of left and right flank over the nodes of the contour.
    """

    def __init__(self, contours: tuple[Contour, Contour]):
        self.contours = contours
        ends = np.cumsum([2, 2 * ARC_NODES, *(len(contour.points) for contour in contours)])
        self.ring, self.bushing, self.distance, self.size = 0, 1, int(ends[3]), int(ends[3]) + 1
        self.arcs, *self.flanks = (slice(int(a), int(b)) for a, b in pairwise(ends))

    def rates(self, rig: Rig, ring_radius: float | None, worked: Worked, coefficients: Coefficients) -> np.ndarray:
        """Change of the state for each metre that the chain runs, of the work over a stretch."""
        c, chain, rates = coefficients, rig.chain, np.zeros(self.size)
        if ring_radius is not None:
            rates[self.ring] = depth(worked.ring, c.ring, 2 * pi * ring_radius * rig.ring_contact.contact_length)
        rates[self.bushing] = depth(worked.bushing, c.bushing, 2 * chain.pitches * c.bushing_area)
        width = rig.tooth_contact.contact_length
        strip = 2 * pi / ARC_NODES * chain.connector_radius * width
        rates[self.arcs] = depth(worked.arcs.ravel(), c.arc, chain.pitches * strip)
        for flank, contour, work in zip(self.flanks, self.contours, worked.flanks, strict=True):
            area = rig.sprocket.teeth * width * contour.length
            rates[flank] = depth(contour.spread(c.scatter) @ work, c.tooth, area)
        rates[self.distance] = worked.distance
        return rates / worked.distance


def _rows(loop: Loop, count: int) -> dict[str, np.ndarray]:
    """Contacts of all arcs, configurations, account of sliding and loss in the bushings, a row a step."""
    pitches = range(1, loop.scene.rig.chain.pitches + 1)
    record = loop.samples(count, pitches, frame_stride=1)
    rows = {name: getattr(record, name) for name in ("force", "area", "groove", "frame", "sliding")}
    return rows | {"loss": record.energy[:, BUSHING_LOSS]}


def distribute(loop: Loop, points: list[np.ndarray], turns: float = 1.0) -> Worked:
    """Continue a copy of a loop for some turns of the sprocket and distribute the work of friction.

    The loop is in steady motion; ``points``, (n, 2) each, m, are where the nodes of the flanks are now.
    """
    scene, step = loop.scene, loop.model.step
    loop = loop.changed(rig=scene.rig.changed(sensor__rate=round(1.0 / step)), sliding=True)
    left_flank, right_flank = (np.zeros(len(nodes)) for nodes in points)
    arcs, estimate = np.zeros((2, ARC_NODES)), 0.0
    before = first = _rows(loop, 1)
    left = round(turns * 2 * pi / abs(scene.sprocket_rate) / step)
    while left:
        rows = _rows(loop, count := min(left, CHUNK))
        both = {name: np.concatenate([before[name], values]) for name, values in rows.items()}
        estimate += _deposit(loop, both, points, (left_flank, right_flank), arcs)
        before, left = {name: values[-1:] for name, values in rows.items()}, left - count
    done, lost, moved = (before[name][0] - first[name][0] for name in ("sliding", "loss", "frame"))
    rig = scene.rig
    pitch = rig.single_pin_pitch if scene.chain == "single_pin" else rig.chain.link_length + rig.connector_length
    distance = abs(moved[-1]) / (2 * pi) * rig.sprocket.teeth * pitch
    return Worked((left_flank, right_flank), arcs, done[:AREAS], float(done[AREAS]), float(lost), distance, estimate)


def _deposit(loop: Loop, rows: dict, points, flanks, arcs) -> float:
    """Add the work of every step to the nodes; returns its sum by the law of friction alone, J."""
    tooth, shoes, chain, step = loop.model.tooth, loop.model.shoes, loop.model.chain, loop.model.step
    row, pitch, side = np.nonzero(rows["area"][:-1])  # contacts at the beginning of each step
    if not len(row):
        return 0.0
    area, groove = (rows[name][row, pitch, side].astype(int) for name in ("area", "groove"))
    force, arc, j = rows["force"][row, pitch, side], 2 * pitch + side, area - 1
    body = shoes.arc_body[arc]
    gc, gs = tooth.groove_cos[groove - 1], tooth.groove_sin[groove - 1]
    local, angle, turned, hub = [], [], [], (loop.model.wheels.x[0], loop.model.wheels.y[0])
    for frame in (rows["frame"][row], rows["frame"][row + 1]):
        # frame of the groove (`contact.laws.in_groove`), at both ends of the step
        c, s = np.cos(frame[:, -1]), np.sin(frame[:, -1])
        turned.append((c * gc - s * gs, s * gc + c * gs))
        x, y = (_centres(frame, chain.length, body, shoes.arc_x[arc]) - hub).T
        ck, sk = turned[-1]
        local.append(np.column_stack([ck * x + sk * y, ck * y - sk * x]))
        angle.append(np.column_stack([frame[np.arange(len(row)), 2 + body], frame[:, -1]]))
    middle = np.column_stack([tooth.centre_x[j], tooth.centre_y[j]])
    out = local[0] - middle
    out /= np.hypot(*out.T)[:, None]
    touch = middle + tooth.radius[j, None] * out
    normal = out * np.where(tooth.convex[j], 1.0, -1.0)[:, None]  # of the force on the connector
    moved = local[1] - local[0]
    spin = (angle[1] - angle[0]) @ (1.0, -1.0)  # of the connector against the sprocket
    slip = np.abs(normal[:, 0] * moved[:, 1] - normal[:, 1] * moved[:, 0] - tooth.arc_radius * spin)
    by_law = force * [friction_coefficient(tooth.law, speed) for speed in slip / step] * slip
    # the account of each area in each step, divided among its contacts
    done = np.diff(rows["sliding"][:, :AREAS], axis=0)[row, j]
    group = row * AREAS + j
    total, count = np.bincount(group, by_law)[group], np.bincount(group)[group]
    work = done * np.divide(by_law, total, out=1.0 / count, where=total > 0)
    right = area > AREAS // 2
    for flank, nodes, here, mirror in zip(flanks, points, (~right, right), (1.0, -1.0), strict=True):
        # to the two nodes beside each contact, in proportion to their distance
        at = np.interp(mirror * touch[here, 0], nodes[:, 0], np.arange(len(nodes)))
        low = np.minimum(at.astype(int), len(nodes) - 2)
        for node, share in ((low, 1.0 - (at - low)), (low + 1, at - low)):
            flank += np.bincount(node, work[here] * share, len(nodes))
    ck, sk = turned[0]
    nx, ny = normal.T
    toward = np.arctan2(-(sk * nx + ck * ny), -(ck * nx - sk * ny)) - angle[0][:, 0]
    node = np.rint(toward / (2 * pi) * ARC_NODES).astype(int) % ARC_NODES
    arcs += np.bincount(side * ARC_NODES + node, work, 2 * ARC_NODES).reshape(2, ARC_NODES)
    return float(by_law.sum())


def _centres(frame: np.ndarray, length: np.ndarray, body: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(k, 2) centres of arcs on bodies (k,) of configurations (k, n + 3), m."""
    reach = np.arange(len(length)) < body[:, None]
    far = np.where(reach, length, 0.0) + np.where(np.arange(len(length)) == body[:, None], along[:, None], 0.0)
    angles = frame[:, 2:-1]
    return frame[:, :2] + np.column_stack([(far * np.cos(angles)).sum(axis=1), (far * np.sin(angles)).sum(axis=1)])
