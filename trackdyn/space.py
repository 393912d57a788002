"""What a scene needs to move in space: wheel frames, widths, guides, inertias, and the plane it starts in."""

from math import radians

import numpy as np

from trackdyn.chain.spatial import (
    INDEPENDENT,
    ISOTROPIC,
    TANGENTIAL,
    Plane,
    PlaneRecord,
    Space,
    Spatial,
    make_plane_record,
    make_space_work,
)
from trackdyn.errors import InputError
from trackdyn.model import SPROCKET, Model, State
from trackdyn.scene import Scene

FRICTION = {"none": TANGENTIAL, "tangential": TANGENTIAL, "independent": INDEPENDENT, "isotropic": ISOTROPIC}


def wheel_frame(toe: float, camber: float) -> np.ndarray:
    """``A_W``: the wheel's frame to the inertial one, ``A_y(toe) A_x(camber)``; angles in rad."""
    ct, st, cc, sc = np.cos(toe), np.sin(toe), np.cos(camber), np.sin(camber)
    about_y = np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cc, -sc], [0.0, sc, cc]])
    return about_y @ about_x


def wheel_centres(scene: Scene, model: Model) -> np.ndarray:
    """(w, 3) inertial places of the wheels' middles, m."""
    parts = (scene.rig.sprocket, scene.rig.idler, scene.rig.road_wheel)
    return np.array([[x, y, p.axial_offset] for x, y, p in zip(model.wheels.x, model.wheels.y, parts, strict=False)])


def build_constants(scene: Scene, model: Model) -> Space:
    """Constants of the motion in space of the chain of links and connectors.

    The guides are the connectors'. On the sprocket they are between flanges as far out as its teeth
    reach (Eq. 18), on the others and on a sprocket without teeth while the connector is less than
    half a link's thickness further out than where links lie.
    """
    rig, tooth, wheels = scene.rig, model.tooth, model.wheels
    if scene.chain != "double_pin":
        raise InputError(f"scene: chain = {scene.chain!r} is not accepted: motion in space needs 'double_pin'")
    parts = (rig.sprocket, rig.idler, rig.road_wheel)[: len(wheels.x)]
    frame = np.array([wheel_frame(radians(part.toe), radians(part.camber)) for part in parts])
    reach = np.where(wheels.present, wheels.radius + 2 * wheels.half_thickness, 0.0)
    if tooth.present:
        reach[SPROCKET] = tooth.addendum + tooth.arc_radius
    surfaces = (rig.tooth_contact, rig.ring_contact, rig.wheel_contact)
    c, pitches = rig.chain, rig.chain.pitches
    return Space(
        np.tile([c.link_inertia_along, c.connector_inertia_along], pitches),
        np.tile([c.link_inertia_across, c.connector_inertia_across], pitches),
        frame,
        np.einsum("wji,wj->wi", frame, wheel_centres(scene, model)),
        np.array([surface.contact_length for surface in surfaces]),
        np.array([surface.axial_overhang for surface in surfaces]),
        reach,
        float(rig.guide.clearance),
        float(rig.guide.stiffness),
        float(rig.guide.damping),
        FRICTION[scene.fidelity["friction"].setting],
    )


def start_plane(place: np.ndarray, model: Model, state: State) -> Plane:
    """The plane through the middles of the wheels, at rest; the loop is laid into it in ``state``.

    Without axial offsets that is the plane of the planar model, exactly. The least turn takes one
    plane to the other, and the loop is shifted in it so that it stays where it was on the sprocket.
    ``place`` holds the wheels' middles, m.
    """
    motion, attitude = np.zeros(4), np.array([1.0, 0.0, 0.0, 0.0])
    if not place[:, 2].any():
        return Plane(motion, attitude)
    sides = np.column_stack([np.ones(len(place)), model.wheels.x, model.wheels.y])
    z0, slope_x, slope_y = np.linalg.lstsq(sides, place[:, 2], rcond=None)[0]
    normal = np.array([-slope_x, -slope_y, 1.0]) / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    # from e_z to the normal: Euler parameters (1 + e_z . n, e_z x n), normalised
    attitude[:] = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0]) / np.sqrt(2.0 * (1.0 + normal[2]))
    motion[0] = z0 * normal[2]
    # A_P^T R of the sprocket's centre; rows of A_P^T for a turn about an axis in the plane
    h, k = normal, 1.0 / (1.0 + normal[2])
    x_axis = np.array([1.0 - k * h[0] ** 2, -k * h[0] * h[1], -h[0]])
    y_axis = np.array([-k * h[0] * h[1], 1.0 - k * h[1] ** 2, -h[1]])
    state.pin[0] += x_axis @ place[SPROCKET] - model.wheels.x[SPROCKET]
    state.pin[1] += y_axis @ place[SPROCKET] - model.wheels.y[SPROCKET]
    return Plane(motion, attitude)


def build_space(scene: Scene, model: Model, state: State, record: PlaneRecord | None = None) -> Spatial:
    """Motion in space for a settled planar loop, which is laid into its starting plane (``state`` is changed).

    Parameters
    ----------
    scene : Scene
        Its rig gives wheels, guide and inertias; its fidelity the kind of friction.
    model, state
        As `trackdyn.settling.settle` gives them.
    record : PlaneRecord or None
        Where samples are kept; None: room for one.
    """
    space = build_constants(scene, model)
    n, wheels, pitches = len(state.angle), len(model.wheels.x), len(model.shoes.link_body)
    record = make_plane_record(1, wheels) if record is None else record
    return Spatial(
        space, start_plane(wheel_centres(scene, model), model, state), make_space_work(n, wheels, pitches), record
    )
