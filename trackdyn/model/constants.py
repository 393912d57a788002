"""Constants of a run, in SI units.

A closed chain has ``n`` rigid bodies (link, connector, link, ...). The output pin of a body is the input pin of the
next one; that of the last body is cut (element 70 of the paper). Vectors are in the inertial frame; an angle is the
direction from input to output pin, counter-clockwise from the inertial x axis.
"""

from typing import NamedTuple

import numpy as np

SPROCKET = 0  # the first wheel: its motion is prescribed and links touch its ring
TANGENTIAL, INDEPENDENT = range(2)  # kinds of friction in space: Eq. 10 only, Eqs. 10 and 11 independently


class Chain(NamedTuple):
    """Chain of ``n`` bodies."""

    length: np.ndarray  # (n,) pin to pin length, m
    mass: np.ndarray  # (n,) mass, kg
    inertia: np.ndarray  # (n,) moment of inertia about the mass centre, kg m2
    com_x: np.ndarray  # (n,) mass centre from the input pin, x to the output pin, y its left normal, m
    com_y: np.ndarray
    # bushing of every joint: torque ``-stiffness (phi - free_angle) - damping phi'`` on the outboard body with
    # ``phi = angle[i+1] - angle[i]``; N m/rad, N m s/rad, rad
    stiffness: float
    damping: float
    free_angle: float
    gravity: float  # magnitude of gravity along -y, m/s2


class Shoes(NamedTuple):
    """Positions of the links and the connectors' arcs on the bodies of the chain, for ``p`` pitches."""

    link_body: np.ndarray  # (p,) integers: body that carries the link of a pitch
    link_start: np.ndarray  # (p,) ends A, B of the link's middle line on the body's pin line, from its input pin, m
    link_end: np.ndarray
    arc_body: np.ndarray  # (2 p,) integers: body of the left (even entries) and right (odd) arc of each connector
    arc_x: np.ndarray  # (2 p,) their centres on the body's pin line, from its input pin, m


class Law(NamedTuple):
    """Law of the contact between two surfaces."""

    form: int  # one of `contact.laws.FORMS`
    stiffness: float  # ``pi L E* / (2 sqrt 2)`` of Eq. 8, N/m
    loss: float  # chi of the relative velocity: ``3 (1 - c_r^2) / 4`` of Eq. 8, the one that delivers c_r, or 0
    friction_static: float  # coefficients of Eq. 10; both 0: no friction
    friction_dynamic: float
    transition_velocity: float  # v_t of Eq. 10, m/s
    shear_stiffness: float  # of Dahl's law of friction, a link, N/m; 0: Eq. 10
    speed_floor: float  # least initial impact velocity, m/s
    factor_limit: float  # upper bound of the bracket of Eq. 8 (its lower bound is 0: contact never pulls)


LAW = np.dtype(list(Law.__annotations__.items()))  # a law as a row of an array


class Tooth(NamedTuple):
    """Contact between connectors and grooves."""

    present: int  # 0: the scene has no teeth
    centre_x: np.ndarray  # (k,) arcs O_j and r_j in the groove frame (Table 1), m; ten, or five of the coarse profile
    centre_y: np.ndarray
    radius: np.ndarray
    direction_x: np.ndarray  # (k,) u_j and, below, cos theta_j of Eq. 23
    direction_y: np.ndarray
    cos_half_angle: np.ndarray
    convex: np.ndarray  # (k,) integers: 1 for areas 1, 4, 7, 10 of the ten
    groove_cos: np.ndarray  # (m,) cosine and sine of beta_k (Eq. 12)
    groove_sin: np.ndarray
    teeth: int  # m
    half_pitch: float  # tan(pi / m): half the sector of a groove
    addendum: float  # r_a of Eq. 18, m
    arc_radius: float  # r_C of the connector's arcs, m
    law: Law  # steel on steel
    # mobility of the chain across itself at an arc, and (2, 3) of a left and a right arc that slides
    # (`scene.build.mobility_of_slip`), 1/kg; 0 where a method has forces and velocities of one instant
    mobility: float = 0.0
    slip: np.ndarray = np.zeros((2, 3))


class Wheels(NamedTuple):
    """Wheels that links touch, ``w`` of them: 0 the sprocket's ring, then the others."""

    present: np.ndarray  # (w,) integers: 0: no contact with links (a sprocket without ring)
    x: np.ndarray  # (w,) centre, radius (m), moment of inertia (kg m2). The sprocket's motion is prescribed
    y: np.ndarray
    radius: np.ndarray
    inertia: np.ndarray
    drag: np.ndarray  # (w,) viscous drag of the bearing (N m s/rad), and torque against any rotation (N m)
    torque: np.ndarray
    half_thickness: float  # d/2 of the links, m
    slip: np.ndarray  # (w,) mobility of a link that slides on every wheel, 1/kg; 0 as in `Tooth`
    law: np.ndarray  # (w,) a `LAW` of the links on every wheel
    rolling: np.ndarray  # (w,) lever arm of the rolling resistance of links on every wheel, m


class Closure(NamedTuple):
    """Cut joint: held exactly (``compliant`` 0), or by ``stiffness`` (N/m) and ``damping`` (N s/m; A.6)."""

    compliant: int
    stiffness: float
    damping: float


class Suspensions(NamedTuple):
    """Suspensions (`integrate.suspensions`) of ``k`` wheels; ``k`` is 0 if all wheels are fixed."""

    wheel: np.ndarray  # (k,) integers: wheel of each
    of_wheel: np.ndarray  # (w,) integers: suspension of every wheel, -1 for none
    arm: np.ndarray  # (k,) integers: 1: a trailing arm, its coordinate in rad; 0: a slider, in m
    x: np.ndarray  # (k,) rest position of a slider's wheel, pivot of an arm, m
    y: np.ndarray
    along_x: np.ndarray  # (k,) direction of a slider; of an arm at rest its vector (m) turned by a right angle
    along_y: np.ndarray
    mass: np.ndarray  # (k,) moving mass, spring and damper; kg, N/m, N s/m or kg m2, N m/rad, N m s/rad
    stiffness: np.ndarray
    damping: np.ndarray
    preload: np.ndarray  # (k,) force (N) or torque (N m) of the spring at rest, for a slider without its weight
    weight: np.ndarray  # (k,) weight that an arm lifts with its wheel, N; 0 for sliders
    low: np.ndarray  # (k,) stops, m or rad
    high: np.ndarray


class Drive(NamedTuple):
    """Rate of the sprocket: from ``start`` to ``rate`` (rad/s) in ``ramp`` seconds from ``begin``, then constant."""

    rate: float
    ramp: float
    start: float = 0.0
    begin: float = 0.0


class Sensors(NamedTuple):
    """Acceleration sensors, ``k`` of them."""

    body: np.ndarray  # (k,) integers: body of each
    x: np.ndarray  # (k,) positions in the frame of that body, m
    y: np.ndarray


class Space(NamedTuple):
    """Constants of motion in space beyond those of the planar model."""

    along: np.ndarray  # (n,) moments of inertia of the bodies about their pin lines and, below, normals, kg m2
    across: np.ndarray
    frame: np.ndarray  # (w, 3, 3) ``A_W``: frame of every wheel (not spinning, z its axis) to the inertial one
    centre: np.ndarray  # (w, 3) centres of the wheels in their own frames, ``A_W^T R_W``, m
    length: np.ndarray  # (3,) contact length, and shift before the overlap of Eq. 19 shrinks, m: wheels, teeth, ring
    overhang: np.ndarray
    guide_reach: np.ndarray  # (w,) distance from the axis at which connectors leave the wheel's flanges, m
    clearance: float  # play of a centre guide to either side (m), and its spring and damper beyond (N/m, N s/m)
    stiffness: float
    damping: float
    friction: int  # ``TANGENTIAL`` (no axial friction) or ``INDEPENDENT`` (Eqs. 10 and 11 each for itself)


class Maxwell(NamedTuple):
    """Maxwell elements of every bushing (`chain.kinematics`), ``b`` of them: 0 with a viscous damper."""

    stiffness: np.ndarray  # (b,) N m/rad
    time: np.ndarray  # (b,) relaxation time, s


NO_MAXWELL = Maxwell(np.empty(0), np.empty(0))


class Model(NamedTuple):
    """Constants of a scene for the kernels (`trackdyn.scene.build.build_model`)."""

    chain: Chain
    shoes: Shoes
    tooth: Tooth
    wheels: Wheels
    drive: Drive
    sensors: Sensors
    closure: Closure
    step: float  # s
    stride: int  # steps in a sample
    suspensions: Suspensions
    space: Space | None = None  # None in the plane
    maxwell: Maxwell = NO_MAXWELL
