"""Constants of a run, in SI units.

A closed chain of ``n`` rigid bodies (link, connector, link, ...). Body ``i`` runs from its input pin to its
output pin, which is the input pin of body ``i + 1``; the output pin of the last body is the input pin of the
first one (the joint that is cut, element 70 of the paper). All vectors are in the inertial frame; an angle is
the direction of the line input pin -> output pin, counter-clockwise from the inertial x axis.
"""

from typing import NamedTuple

import numpy as np

# wheel 0 is the sprocket: its motion is prescribed and links touch its ring
SPROCKET = 0
# kinds of friction in space: Eq. 10 only, Eqs. 10 and 11 independently
TANGENTIAL, INDEPENDENT = range(2)


class Chain(NamedTuple):
    """Chain of ``n`` bodies."""

    length: np.ndarray  # (n,) pin to pin length, m
    mass: np.ndarray  # (n,) mass, kg
    inertia: np.ndarray  # (n,) moment of inertia about the mass centre, kg m2
    # com_x, com_y: (n,) mass centre in the body frame (x from input to output pin, y its left normal), from the input
    # pin, m
    com_x: np.ndarray
    com_y: np.ndarray
    # stiffness, damping, free_angle: rubber bushing of every revolute joint: torque on the outboard body ``-stiffness
    # (phi - free_angle) - damping phi'`` with ``phi = angle[i+1] - angle[i]``; N m/rad, N m s/rad, rad
    stiffness: float
    damping: float
    free_angle: float
    gravity: float  # magnitude of gravity along -y, m/s2


class Shoes(NamedTuple):
    """Positions of the links and the connectors' arcs on the bodies of the chain, for ``p`` pitches."""

    link_body: np.ndarray  # (p,) integers: body that carries the link of a pitch
    # link_start, link_end: (p,) the ends A and B of the link's middle line on the body's pin line, from its input pin,
    # m
    link_start: np.ndarray
    link_end: np.ndarray
    # (2 p,) integers: body that carries the left (even entries) and right (odd) arc of the connector of a pitch
    arc_body: np.ndarray
    arc_x: np.ndarray  # (2 p,) their centres on the body's pin line, from its input pin, m


class Law(NamedTuple):
    """Law of the contact between two surfaces."""

    form: int  # one of `contact.laws.FORMS`
    stiffness: float  # ``pi L E* / (2 sqrt 2)`` of Eq. 8, N/m
    # factor chi of the relative penetration velocity: ``3 (1 - c_r^2) / 4`` of Eq. 8, the one that delivers c_r, or 0
    # for an elastic contact
    loss: float
    # friction_static, friction_dynamic: coefficients of Eq. 10; both 0: no friction
    friction_static: float
    friction_dynamic: float
    transition_velocity: float  # v_t of Eq. 10, m/s
    shear_stiffness: float  # of Dahl's law of friction, a link, N/m; 0: Eq. 10
    speed_floor: float  # least initial impact velocity, m/s
    factor_limit: float  # upper bound of the bracket of Eq. 8 (its lower bound is 0: contact never pulls)


LAW = np.dtype(list(Law.__annotations__.items()))  # a law as a row of an array


class Tooth(NamedTuple):
    """Contact between connectors and grooves."""

    present: int  # 0: the scene has no teeth
    # centre_x, centre_y, radius: (k,) arcs O_j and r_j in the groove frame (Table 1), m; ten of them, or five of the
    # coarse profile, edges included
    centre_x: np.ndarray
    centre_y: np.ndarray
    radius: np.ndarray
    # direction_x, direction_y, cos_half_angle: (k,) u_j and cos theta_j of Eq. 23
    direction_x: np.ndarray
    direction_y: np.ndarray
    cos_half_angle: np.ndarray
    convex: np.ndarray  # (k,) integers: 1 for areas 1, 4, 7, 10 of the ten
    # groove_cos, groove_sin: (m,) cosine and sine of beta_k (Eq. 12)
    groove_cos: np.ndarray
    groove_sin: np.ndarray
    teeth: int  # m
    half_pitch: float  # tan(pi / m): half the sector of a groove
    addendum: float  # r_a of Eq. 18, m
    arc_radius: float  # r_C of the connector's arcs, m
    law: Law  # steel on steel
    # mobility of the chain across itself where an arc touches (`scene.build`), 1/kg; 0 where the method has forces and
    # velocities of the same instant
    mobility: float = 0.0
    # (2, 3) mobility of a left and of a right arc where it slides (`scene.build.mobility_of_slip`), 1/kg; 0 likewise
    slip: np.ndarray = np.zeros((2, 3))


class Wheels(NamedTuple):
    """Wheels that links touch, ``w`` of them: 0 the sprocket's ring, then the others."""

    present: np.ndarray  # (w,) integers: 0: no contact with links (a sprocket without ring)
    # x, y, radius, inertia: (w,) centre, radius, moment of inertia; SI. The sprocket's motion is prescribed
    x: np.ndarray
    y: np.ndarray
    radius: np.ndarray
    inertia: np.ndarray
    # drag, torque: (w,) viscous drag of the bearing (N m s/rad) and torque against the rotation at any rate (N m)
    drag: np.ndarray
    torque: np.ndarray
    half_thickness: float  # d/2 of the links, m
    # (w,) mobility of a link that slides on every wheel, 1/kg; 0 where the method has forces and velocities of the same
    # instant
    slip: np.ndarray
    law: np.ndarray  # (w,) a `LAW` of the links on every wheel
    rolling: np.ndarray  # (w,) lever arm of the rolling resistance of links on every wheel, m


class Closure(NamedTuple):
    """Cut joint: held exactly (``compliant`` 0), or by ``stiffness`` (N/m) and ``damping`` (N s/m; A.6)."""

    compliant: int
    stiffness: float
    damping: float


class Carriers(NamedTuple):
    """Suspensions of ``k`` wheels on springs and dampers (`integrate.carriers`); ``k`` is 0 if all wheels are fixed."""

    wheel: np.ndarray  # (k,) integers: which one each carries
    of_wheel: np.ndarray  # (w,) integers: the carrier of every wheel, -1 for none
    arm: np.ndarray  # (k,) integers: 1: a trailing arm, its coordinate in rad; 0: a slider, in m
    # x, y: (k,) rest position of a slider's wheel, pivot of an arm, m
    x: np.ndarray
    y: np.ndarray
    # along_x, along_y: (k,) direction in which a slider moves; of an arm its length (m) turned by a right angle, at
    # rest
    along_x: np.ndarray
    along_y: np.ndarray
    # mass, stiffness, damping: (k,) moving mass, its spring and its damper; kg, N/m, N s/m or kg m2, N m/rad, N m s/rad
    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    preload: np.ndarray  # (k,) force (N) or torque (N m) of the spring at rest, for a slider without its weight
    weight: np.ndarray  # (k,) weight that an arm lifts with its wheel, N; 0 for sliders
    # low, high: (k,) stops, m or rad
    low: np.ndarray
    high: np.ndarray


class Drive(NamedTuple):
    """Rate of the sprocket: from ``start`` to ``rate`` (rad/s) in ``ramp`` seconds from ``begin``, then constant."""

    rate: float
    ramp: float
    start: float = 0.0
    begin: float = 0.0


class Sensors(NamedTuple):
    """Acceleration sensors, ``k`` of them."""

    body: np.ndarray  # (k,) integers: body that carries each
    # x, y: (k,) positions in the frame of that body, m
    x: np.ndarray
    y: np.ndarray


class Space(NamedTuple):
    """Constants of motion in space beyond those of the planar model."""

    # along, across: (n,) principal moments of inertia of the bodies about their x axis (pin line) and y axis (normal of
    # the track), kg m2; the third one is that of the planar chain
    along: np.ndarray
    across: np.ndarray
    # (w, 3, 3) ``A_W`` of every wheel: its frame, which does not spin, to the inertial one; z is its axis
    frame: np.ndarray
    centre: np.ndarray  # (w, 3) centres of the wheels in their own frames, ``A_W^T R_W``, m
    # length, overhang: (3,) contact length and the shift before the overlap of Eq. 19 shrinks, of links on wheels,
    # connectors on teeth and links on the ring (`contact.axial`), m
    length: np.ndarray
    overhang: np.ndarray
    # (w,) distance from the wheel's axis up to which the middle of a connector is between its flanges, m
    guide_reach: np.ndarray
    # clearance, stiffness, damping: play of a centre guide to either side (m), and its spring and damper beyond (N/m, N
    # s/m)
    clearance: float
    stiffness: float
    damping: float
    friction: int  # ``TANGENTIAL`` (no axial friction) or ``INDEPENDENT`` (Eqs. 10 and 11 each for itself)


class Branches(NamedTuple):
    """Maxwell elements of every bushing (`chain.kinematics`): stiffness (N m/rad) and relaxation time (s), (b,) arrays;
    b is 0 for bushings with a viscous damper.
    """

    stiffness: np.ndarray
    time: np.ndarray


NO_BRANCHES = Branches(np.empty(0), np.empty(0))


class Model(NamedTuple):
    """Constants of a scene as kernels take them (`trackdyn.scene.build.build_model`).

    ``step`` is in s, ``stride`` the number of steps in a sample, ``space`` None for a planar scene.
    """

    chain: Chain
    shoes: Shoes
    tooth: Tooth
    wheels: Wheels
    drive: Drive
    sensors: Sensors
    closure: Closure
    step: float
    stride: int
    carriers: Carriers
    space: Space | None = None
    branches: Branches = NO_BRANCHES
