"""Work of friction over the contour of the grooves and the arcs of the connectors, step by step.

A running loop goes on for a turn of the sprocket, every groove visited once, with a sample a step. The account of
sliding (`Recording.sliding`) says what friction did in each area in each step; the contacts at the beginning of the
step say where. The work of an area is divided among the contacts in it by their own friction, force times coefficient
times slip, so that the sum over the contour is the account's to rounding.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from laboratory.wear.contour import ARC_NODES, Contour
from trackdyn.errors import InputError
from trackdyn.model.constants import Law
from trackdyn.model.record import BUSHING_LOSS
from trackdyn.simulation.loop import Loop

CHUNK = 2000  # steps
AREAS = 10  # of the grooves that wear


class Worked(NamedTuple):
    """Work of friction over a stretch, J."""

    flanks: tuple[np.ndarray, np.ndarray]  # by groove and node of left and right flank
    arcs: np.ndarray  # (2, ARC_NODES) of all left and all right arcs, over the angle from the connector's own x axis
    areas: np.ndarray  # (10,) by area, of the account of sliding
    ring: float  # of the links on the ring
    bushing: float  # lost in all bushings
    distance: float  # what the chain ran, m
    estimate: float  # sum over the teeth by the law of friction alone, without the account


def _rows(loop: Loop, count: int) -> dict[str, np.ndarray]:
    """Contacts of all arcs, configurations, account of sliding and loss in the bushings, a row a step."""
    pitches = range(1, loop.scene.rig.chain.pitches + 1)
    record = loop.room(count, pitches=pitches, frames=count, frame_stride=1, sliding=len(loop.work.sliding))
    loop.fill(record)
    rows = {name: getattr(record, name) for name in ("force", "area", "groove", "frame", "sliding")}
    return rows | {"loss": record.energy[:, BUSHING_LOSS]}


def distribute(loop: Loop, of: tuple[Contour, Contour], points: list[np.ndarray], turns: float = 1.0) -> Worked:
    """Go on with a copy of a loop for some turns of the sprocket, and say where friction worked.

    The loop is in steady motion; ``points``, (n, 2) each, m, are where the nodes of the flanks are now.

    Raises
    ------
    InputError
        No whole number of steps fits into a second, or the grooves have another number of arcs.
    """
    scene, step = loop.scene, loop.model.step
    rate = round(1.0 / step)
    if abs(rate * step - 1.0) > 1e-9:
        raise InputError(f"step = {step!r} s: wear needs a whole number of steps a second, as 1e-4")
    if len(loop.model.tooth.radius) != AREAS:
        raise InputError(f"tooth_contact = {scene.tooth_contact!r}: wear needs ten arcs")
    loop = loop.changed(rig=scene.rig.changed(sensor__rate=rate), sliding=True)
    flanks = tuple(np.zeros((scene.rig.sprocket.teeth, len(contour.points))) for contour in of)
    arcs, estimate = np.zeros((2, ARC_NODES)), 0.0
    before = _rows(loop, 1)
    first, left = before, round(turns * 2 * pi / abs(scene.sprocket_rate) / step)
    while left:
        rows = _rows(loop, count := min(left, CHUNK))
        both = {name: np.concatenate([before[name], part]) for name, part in rows.items()}
        estimate += _deposit(loop, both, points, flanks, arcs)
        before, left = {name: part[-1:] for name, part in rows.items()}, left - count
    change = {name: before[name][0] - first[name][0] for name in ("sliding", "loss", "frame")}
    done, turned = change["sliding"], abs(change["frame"][-1]) / (2 * pi)
    rig = scene.rig
    pitch = rig.single_pin_pitch if scene.chain == "single_pin" else rig.chain.link_length + rig.connector_length
    return Worked(
        flanks, arcs, done[:AREAS], float(done[AREAS]), float(change["loss"]),
        turned * rig.sprocket.teeth * pitch, estimate,
    )  # fmt: skip


def _deposit(loop: Loop, rows: dict, points, flanks, arcs) -> float:
    """Add the work of every step to the nodes; returns its sum by the law of friction alone, J."""
    tooth, shoes, chain, step = loop.model.tooth, loop.model.shoes, loop.model.chain, loop.model.step
    row, pitch, side = np.nonzero(rows["area"][:-1])  # contacts at the beginning of each step
    if not len(row):
        return 0.0
    area, groove = (part[row, pitch, side].astype(int) for part in (rows["area"], rows["groove"]))
    force, arc, j = rows["force"][row, pitch, side], 2 * pitch + side, area - 1
    body = shoes.arc_body[arc]
    gc, gs = tooth.groove_cos[groove - 1], tooth.groove_sin[groove - 1]
    local, angle, turned, hub = [], [], [], (loop.model.wheels.x[0], loop.model.wheels.y[0])
    for frame in (rows["frame"][row], rows["frame"][row + 1]):
        # frame of the groove (`contact.tooth.in_groove`), at both ends of the step
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
    own = force * _coefficient(tooth.law, slip / step) * slip
    # the account of each area in each step, divided among its contacts
    done = np.diff(rows["sliding"][:, :AREAS], axis=0)[row, j]
    group = row * AREAS + j
    total, count = np.bincount(group, own)[group], np.bincount(group)[group]
    work = done * np.divide(own, total, out=1.0 / count, where=total > 0)
    _add_flanks(points, flanks, touch, groove, area > AREAS // 2, work)
    ck, sk = turned[0]
    nx, ny = normal.T
    toward = np.arctan2(-(sk * nx + ck * ny), -(ck * nx - sk * ny)) - angle[0][:, 0]
    place = np.rint(toward / (2 * pi) * ARC_NODES).astype(int) % ARC_NODES
    arcs += np.bincount(side * ARC_NODES + place, work, 2 * ARC_NODES).reshape(2, ARC_NODES)
    return float(own.sum())


def _centres(frame: np.ndarray, length: np.ndarray, body: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(k, 2) centres of arcs on bodies (k,) of configurations (k, n + 3), m."""
    reach = np.arange(len(length)) < body[:, None]
    far = np.where(reach, length, 0.0) + np.where(np.arange(len(length)) == body[:, None], along[:, None], 0.0)
    angles = frame[:, 2:-1]
    return frame[:, :2] + np.column_stack([(far * np.cos(angles)).sum(axis=1), (far * np.sin(angles)).sum(axis=1)])


def _coefficient(law: Law, slip: np.ndarray) -> np.ndarray:
    """Coefficient of Eq. 10 at slip velocities, m/s (`contact.laws.friction_coefficient`)."""
    x = slip / law.transition_velocity
    q = 0.25 * x * x + 0.75
    return law.friction_dynamic * np.tanh(4 * x) + (law.friction_static - law.friction_dynamic) * x / q**2


def _add_flanks(points, flanks, touch, groove, right, work) -> None:
    """Work to the two nodes beside each place, in proportion to their distance; by groove."""
    for flank, nodes, which, mirror in ((flanks[0], points[0], ~right, 1.0), (flanks[1], points[1], right, -1.0)):
        n = len(nodes)
        at = np.interp(mirror * touch[which, 0], nodes[:, 0], np.arange(n))
        low = np.minimum(at.astype(int), n - 2)
        share, number = at - low, (groove[which] - 1) * n
        for node, part in ((low, 1.0 - share), (low + 1, share)):
            flank += np.bincount(number + node, work[which] * part, flank.size).reshape(flank.shape)
