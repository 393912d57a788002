"""Arrays that kernels write: state of a loop, arrays of a step, record of a run; and the names of their columns."""

from collections import namedtuple
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from trackdyn.model.constants import Model


def zeros(kind: type | np.dtype = float, /, **shapes: int | tuple[int, ...]) -> dict[str, Any]:
    """Allocate an array of zeros for every name."""
    return {name: np.zeros(shape, kind) for name, shape in shapes.items()}


OFFSET, SPEED, P, Q = range(4)  # entries of the plane's motion
# Motion of a suspension: coordinate q from its rest position (m or rad), its rate and that before the last step, and
# the direction of the wheel's motion in that step (`integrate.suspensions.along`).
SUSPENSION = np.dtype([(name, float) for name in ("q", "rate", "rate_before", "along_x", "along_y")])


class Plane(NamedTuple):
    """State of the plane of the chain (`integrate.plane`)."""

    motion: np.ndarray  # (4,) offset and speed along its normal (m, m/s), angular velocities p, q (rad/s), in its frame
    attitude: np.ndarray  # (4,) Euler parameters of ``A_P``, the scalar first


class State(NamedTuple):
    """State of a chain of ``n`` bodies and ``p`` pitches on ``w`` wheels."""

    steps: np.ndarray  # (1,) integers: steps taken; the time is ``steps * step``
    pin: np.ndarray  # (4,) position and velocity of the input pin of body 1 (m, m/s)
    angle: np.ndarray  # (n,) orientation of the bodies, rad
    rate: np.ndarray  # (n,) their angular velocity, rad/s
    wheel_angle: np.ndarray  # (w,) the same of the wheels
    wheel_rate: np.ndarray
    tooth_impact: np.ndarray  # (2 p,) initial impact velocity of left (even), right (odd) arcs, 0 without contact, m/s
    wheel_impact: np.ndarray  # (p, w) the same for link and wheel
    shear: np.ndarray  # (2, p w) displacement of a link along every wheel under Dahl's law (m), and its ``steps``
    work_done: np.ndarray  # (8,) work by entry of the energy balance (`ENERGY_NAMES`), J
    suspension: np.ndarray  # (k,) a `SUSPENSION` of every suspension of a wheel
    maxwell: np.ndarray  # (b, n) moment of every Maxwell element of every bushing, N m
    plane: Plane | None = None  # the plane of the chain; None in planar motion


def make_state(n: int, pitches: int, wheels: int, suspensions: int = 0, maxwell: int = 0) -> State:
    """Allocate the planar state of ``n`` bodies and ``pitches`` pitches on ``wheels`` wheels, everything 0."""
    return State(
        steps=np.zeros(1, np.int64),
        **zeros(pin=4, angle=n, rate=n, wheel_angle=wheels, wheel_rate=wheels, work_done=KINETIC, maxwell=(maxwell, n)),
        **zeros(tooth_impact=2 * pitches, wheel_impact=(pitches, wheels), shear=(2, pitches * wheels)),
        suspension=np.zeros(suspensions, SUSPENSION),
    )


# entries of the energy balance, J: work since the start of the run, then energies of the state
(
    SPROCKET_WORK, TOOTH_NORMAL, TOOTH_FRICTION, RING_FRICTION, WHEEL_NORMAL, WHEEL_FRICTION, BEARING, BUSHING_LOSS,
    KINETIC, GRAVITY, BUSHING_ELASTIC,
) = range(11)  # fmt: skip
ENERGY_NAMES = (
    "sprocket_work", "tooth_normal", "tooth_friction", "ring_friction", "wheel_normal", "wheel_friction", "bearing",
    "bushing_loss", "kinetic", "gravity", "bushing_elastic",
)  # fmt: skip
# names and labels of the contacts with the sprocket, in the order of arrays: arcs of connectors, links on the ring
SIDES, SIDE_WORDS = ("left", "right", "ring"), ("left arc", "right arc", "ring")
# One uninterrupted contact with the sprocket: pitch is 0-based, side the index in `SIDES`; bit j - 1 of areas is 1 if
# area j was visited; an end of 0 is not open; the peak may be between steps; square is of the force.
_INTERVAL = "pitch side groove areas start_s end_s peak_n peak_s impulse_ns square_n2s"
CONTACT_INTERVAL = np.dtype([(name, float) for name in _INTERVAL.split()])


class ContactLog(NamedTuple):
    """Log of the contacts with the sprocket, a `CONTACT_INTERVAL` each."""

    open: np.ndarray  # (3 p,) open contacts of left arc, right arc and ring of each pitch
    last: np.ndarray  # (3 p, 2) their forces in the last step and in the one before, N
    rows: np.ndarray  # (m,) ended intervals; no rows: no log
    count: np.ndarray  # (1,) integers: number of ended intervals, also of those beyond ``m``


class Row(NamedTuple):
    """Shape and type of a row of a recorded array; an array of motion in space is empty in the plane."""

    shape: tuple[int | str, ...]  # numbers, or ``sensors``, ``pitches`` (the recorded ones), ``wheels``
    kind: type = float
    in_space: bool = False


@dataclass(frozen=True)
class Samples:
    """Recorded arrays with a row per sample, filled by `integrate.run`; the only definition of names and shapes."""

    #: (s, k, 3) accelerations of the sensors' points in the frames of their bodies, x and y (m/s2), and the bodies'
    #: angles (rad) at the start of the interval's last step; in the order of ``sensors``.
    raw: Annotated[np.ndarray, Row(("sensors", 3))]
    #: (s, k, 3) the same, mean over the sample interval.
    mean: Annotated[np.ndarray, Row(("sensors", 3))]
    #: (s,) largest distance of the two pins of the cut joint within the interval, m.
    gap: Annotated[np.ndarray, Row(())]
    #: (s, 2) gap before the projection of a step (m), and the velocity at which the two pins separate
    #: (m/s): largest values within the interval.
    cut: Annotated[np.ndarray, Row((2,))]
    #: (s, 2) middle of the body that carries the first sensor, m.
    link_position: Annotated[np.ndarray, Row((2,))]
    #: (s, w) angular velocities of the sprocket and the other wheels, rad/s.
    wheel_rate: Annotated[np.ndarray, Row(("wheels",))]
    #: (s, 11) energy balance and energies, J (``model.arrays.ENERGY_NAMES``).
    energy: Annotated[np.ndarray, Row((len(ENERGY_NAMES),))]
    #: (s, p, 3) normal force of left arc, right arc and ring of the recorded pitches, N.
    force: Annotated[np.ndarray, Row(("pitches", 3))]
    #: (s, 2) sums of the normal and, by size, of the tangential forces of the ring on all links, N.
    ring_force: Annotated[np.ndarray, Row((2,))]
    #: (s, p, 2) area of the left and the right arc, 0 without contact.
    area: Annotated[np.ndarray, Row(("pitches", 2), np.int8)]
    #: (s, p, 2) groove of the left and the right arc, 0 without contact.
    groove: Annotated[np.ndarray, Row(("pitches", 2), np.int8)]
    #: (s, 8) motion in space, offset (m) and speed (m/s) of the chain's plane along its normal, its angular velocity p,
    #: q (rad/s) and its Euler parameters. Every other position and velocity is given in the frame of that plane.
    plane: Annotated[np.ndarray, Row((8,), in_space=True)]
    #: (s, w) where the chain's plane crosses the axis of each wheel, from the wheel's middle, m.
    wheel_offset: Annotated[np.ndarray, Row(("wheels",), in_space=True)]
    #: (s, w) force of the chain on each wheel along its axis, mean over the sample interval, N.
    axial_force: Annotated[np.ndarray, Row(("wheels",), in_space=True)]


SAMPLED: dict[str, Row] = {name: hint.__metadata__[0] for name, hint in Samples.__annotations__.items()}
SampleArrays = namedtuple("SampleArrays", SAMPLED)  # `Samples` as kernels take them


class Record(NamedTuple):
    """Arrays that a run fills."""

    samples: Any  # `SampleArrays`
    pitches: np.ndarray  # (p,) integers: pitches whose contacts are recorded (0-based)
    frame: np.ndarray  # (f, n + 3) configuration every ``frame_stride`` samples: pin x, y, angles, sprocket angle
    frame_stride: int  # samples between frames
    contact_log: ContactLog  # log of the contacts with the sprocket


def make_record(
    samples: int, state, sensors: int, pitches=(), frames: int = 0, frame_stride: int = 0, log_rows: int = 0
) -> Record:
    """Allocate the record of a run with a state: contacts of ``pitches`` (1-based), at most ``log_rows`` intervals."""
    loop, wheels = state.wheel_impact.shape
    counts = {"sensors": sensors, "pitches": len(pitches), "wheels": wheels}

    def rows(row: Row) -> np.ndarray:
        if row.in_space and state.plane is None:
            return np.zeros((0, 0), row.kind)
        return np.zeros((samples, *(counts.get(size, size) for size in row.shape)), row.kind)

    log = zeros(CONTACT_INTERVAL, open=3 * loop, rows=log_rows) | zeros(last=(3 * loop, 2)) | zeros(np.int64, count=1)
    return Record(
        SampleArrays._make(map(rows, SAMPLED.values())), np.array(pitches, np.int64) - 1,
        np.zeros((frames, len(state.angle) + 3)), frame_stride, ContactLog(**log),
    )  # fmt: skip


SURFACE, FLANK, RING, GUIDE = range(4)  # a link on a wheel, an arc in a groove, a link on the ring, a guide in flanges
# A row of the contact list. Normal and friction: force on the body, N; arm: from the body's mass centre to the point,
# m; speed: velocity of the body's point, m/s; spin: velocity of the wheel's point at unit rate, m; rate: of the wheel,
# rad/s; slopes: of forces in a linearly implicit step, kg; slot: in `Work.friction`, arcs first. In space only: z,
# across the plane of the chain, and pin, the point's x and y from the pin of body 1.
CONTACT = np.dtype(
    [(f"{name}_{axis}", float) for name in ("normal", "friction", "arm", "speed", "spin") for axis in "xyz"]
    + [(name, float) for name in ("pin_x", "pin_y", "rate", "normal_slope", "friction_slope")]
    + [(name, np.int64) for name in ("body", "wheel", "kind", "slot")]
)


def components(rows: np.ndarray, name: str, axes: str = "xy") -> np.ndarray:
    """Return the (k, 2) or (k, 3) components of a vector in ``k`` rows of the contact list."""
    return np.stack([rows[f"{name}_{axis}"] for axis in axes], axis=-1)


class SweepWork(NamedTuple):
    """Solution of the chain (`chain.riccati`)."""

    # (n, 8) row of the joint behind body i, ``[S_31, S_32, -h c, E_3x, E_3y, E_3m, E_31 - tau] / D``, and one unused
    gain: np.ndarray
    response: np.ndarray  # (n, 4) angular acceleration of body i for unit ``[lambda_x, lambda_y, lambda_m, 1]``
    end: np.ndarray  # (3, 4) acceleration ``z_b`` at the output of body N
    base: np.ndarray  # (2, 4) acceleration of the input pin of body 1, the same columns
    inverse: np.ndarray  # (3, 3) inverse of the closure matrix
    load: np.ndarray  # (4,) ``[lambda_x, lambda_y, lambda_m, 1]``


class ImplicitWork(NamedTuple):
    """Input of a linearly implicit sweep from the contacts, and its solution, for ``n`` bodies and ``w`` wheels.

    Row 0 of the arrays with a row a wheel belongs to the sprocket, whose motion is prescribed, and stays 0.
    """

    inertia: np.ndarray  # (n, 6) ``h C + h^2 K`` of a body's contacts about its input pin: xx, xy, yy, xa, ya, aa
    couple: np.ndarray  # (n, w, 3) force and moment about its input pin on a body for a unit acceleration of a wheel
    wheel_inertia: np.ndarray  # (w,) ``h C`` of the friction on each wheel, kg m2
    column: np.ndarray  # (w, 3) each wheel's column of E, and of z_b on the way back
    gain: np.ndarray  # (n, w) its contribution to the acceleration across each joint
    response: np.ndarray  # (n, w) angular acceleration of each body for a unit acceleration of a wheel
    base: np.ndarray  # (w, 2) the same for the input pin of body 1
    end: np.ndarray  # (w, 3) the same for the output of the last body
    row: np.ndarray  # (w, w + 3) weighted accelerations of the bodies on each wheel: cut loads, constant part, wheels
    matrix: np.ndarray  # (w + 2, w + 3) equations for the cut loads and the wheels
    load: np.ndarray  # (w + 3,) cut loads, 1, and the accelerations of the wheels but the sprocket


class Stages(NamedTuple):
    """Explicit Runge-Kutta method and the arrays of its stages."""

    a: np.ndarray  # (s, s) coefficients of the stages
    b: np.ndarray  # (s,) weights of the step
    start: np.ndarray  # (m,) state at the start of a step
    slope: np.ndarray  # (s, m) derivative of the state at each stage
    sensed: np.ndarray  # (s, k, 3) ``Work.sensed`` of each stage
    tooth_impact: np.ndarray  # initial impact velocities at the start of the step, which no stage changes
    wheel_impact: np.ndarray


class SpaceWork(NamedTuple):
    """Arrays of motion in space, in components of the frame P of the chain's plane (`integrate.plane`)."""

    attitude: np.ndarray  # (3, 3) ``A_P``
    relative: np.ndarray  # (w, 3, 3) ``A_W^T A_P`` of every wheel: P to wheel
    centre: np.ndarray  # (w, 3) centres of the wheels, m
    gravity: np.ndarray  # (3,) m/s2
    force_z: np.ndarray  # (n,) loads across the plane on the bodies about their mass centres, N and N m
    moment_x: np.ndarray
    moment_y: np.ndarray
    acceleration: np.ndarray  # (3,) ``(A_0z, p', q')``
    change: np.ndarray  # (3,) increment of ``(V_z, p, q)`` in the last step
    wheel_load: np.ndarray  # (w, 6) force and moment on every wheel about its centre, in its own frame
    axial: np.ndarray  # (w,) mean axial force on every wheel over the sample, N


class ContactCandidates(NamedTuple):
    """Arcs and links close to a wheel (`contact.neighbours`), for ``n`` bodies, ``p`` pitches and ``w`` wheels."""

    count: np.ndarray  # (3,) integers: arcs close to the sprocket (-1: no lists), pairs of link and wheel, 1: new lists
    arc: np.ndarray  # (2 p,) integers: these arcs, in rising order
    link: np.ndarray  # (p w, 2) integers: link and wheel of these pairs, in rising order
    groove: np.ndarray  # (2 p,) integers: the groove that each arc touched last, 0 before
    pin_x: np.ndarray  # (n + 1,) pins of these lists, m
    pin_y: np.ndarray
    wheel: np.ndarray  # (w, 2) wheels of these lists, m
    plane: np.ndarray  # (4, 3) attitude of the plane of these lists; its offset and the largest distance, m


class Work(NamedTuple):
    """Arrays of a step for ``n`` bodies, ``p`` pitches and ``w`` wheels."""

    cos: np.ndarray  # (n,) orientation of the bodies
    sin: np.ndarray
    pin_x: np.ndarray  # (n + 1,) input pins of the bodies and output pin of the last one, m
    pin_y: np.ndarray
    com_vx: np.ndarray  # (n,) velocities of the mass centres, m/s
    com_vy: np.ndarray
    alpha: np.ndarray  # (n,) accelerations of the bodies at the start of a step, rad/s2
    pin_ax: np.ndarray  # (n,) those of their input pins, up to the last one that is needed, m/s2
    pin_ay: np.ndarray
    com_dvx: np.ndarray  # (n,) increments of the mass centres' velocities in the last step of order 1, m/s
    com_dvy: np.ndarray
    delta_omega: np.ndarray  # (n,) increments of the angular velocities in it, rad/s
    projection_delta: np.ndarray  # (n,) increment of the angular velocities by its projection, rad/s
    force_x: np.ndarray  # (n,) loads of the contacts on the bodies about their mass centres, N and N m
    force_y: np.ndarray
    moment: np.ndarray
    torque: np.ndarray  # (n,) bushing torque of the joint behind body i on its outboard body, N m; the last: cut joint
    joint_rate: np.ndarray  # (n,) rate of its angle, rad/s
    joint_difference: np.ndarray  # (n,) last result of `chain.kinematics.joint_differences`, rad or rad/s
    joint_loss: np.ndarray  # (n,) loss of its Maxwell elements in the last step of order 1, J
    wheel_torque: np.ndarray  # (w,) torque of the contacts on the wheels, N m
    tooth_force: np.ndarray  # (2 p,) normal force (N), area and groove of every arc, 0 without contact
    tooth_area: np.ndarray
    tooth_groove: np.ndarray
    tooth_before: np.ndarray  # (2 p,) normal force of every arc one step ago, N
    wheel_force: np.ndarray  # (p, w) normal force of every link on every wheel, N
    carried: np.ndarray  # (w,) sum of the normal forces of the links on every wheel, N
    friction: np.ndarray  # (2, 2 p + p w) friction on arcs, then on links by wheel, and the same one step ago, N
    contact: np.ndarray  # (c,) a `CONTACT` each
    count: np.ndarray  # (1,) integers: contacts at present
    cut: np.ndarray  # (6,) gap of the cut joint, its rate, and the gap before the last projection; m, m/s
    worst: np.ndarray  # (3,) largest squares of the gap, of its rate and of the gap before the projection in the sample
    sensed: np.ndarray  # (k, 6) last acceleration (m/s2) and angle (rad) of every sensor, and their sums of the sample
    velocity_history: np.ndarray  # (2, 2, n) ``com_dvx, com_dvy`` of the last two steps that chatter is taken from, m/s
    alternating: np.ndarray  # (2,) sum of the mass-weighted mean squares of alternating velocities (m2/s2), and count
    sweep: SweepWork  # solution of the chain
    candidates: ContactCandidates  # neighbour lists


class OptionalWork(NamedTuple):
    """Arrays that only some scenes have: separate arguments, as numba drops the code of those that are None."""

    space: SpaceWork | None = None  # motion in space
    implicit: ImplicitWork | None = None  # a linearly implicit integrator
    stages: Stages | None = None  # an explicit Runge-Kutta method


def make_work(n: int, pitches: int, wheels: int, sensors: int = 1) -> Work:
    """Allocate the arrays of a planar step of semi-implicit Euler, for ``sensors`` sensors and one more a pitch."""
    arcs, contacts = 2 * pitches, pitches * (2 + 2 * wheels)  # both arcs, a link and a guide on every wheel
    return Work(
        **zeros(cos=n, sin=n, pin_x=n + 1, pin_y=n + 1, com_vx=n, com_vy=n, alpha=n, pin_ax=n, pin_ay=n),
        **zeros(com_dvx=n, com_dvy=n, delta_omega=n, projection_delta=n),
        **zeros(force_x=n, force_y=n, moment=n, torque=n, wheel_torque=wheels),
        **zeros(joint_rate=n, joint_difference=n, joint_loss=n),
        **zeros(tooth_force=arcs, tooth_before=arcs, wheel_force=(pitches, wheels), carried=wheels),
        **zeros(friction=(2, arcs + pitches * wheels), sensed=(sensors + pitches, 6)),
        **zeros(cut=6, worst=3, velocity_history=(2, 2, n), alternating=2),
        **zeros(np.int64, tooth_area=arcs, tooth_groove=arcs, count=1),
        contact=np.zeros(contacts, CONTACT),
        sweep=SweepWork(**zeros(gain=(n, 8), response=(n, 4), end=(3, 4), base=(2, 4), inverse=(3, 3), load=4)),
        candidates=ContactCandidates(
            count=np.full(3, -1),
            **zeros(np.int64, arc=arcs, link=(pitches * wheels, 2), groove=arcs),
            **zeros(pin_x=n + 1, pin_y=n + 1, wheel=(wheels, 2), plane=(4, 3)),
        ),
    )


def make_arrays(model: Model, method) -> tuple[State, Work, OptionalWork]:
    """Allocate planar state and work of a model and a method (`integrate.methods`), everything 0."""
    sizes = len(model.chain.length), len(model.shoes.link_body), len(model.wheels.x)
    state = make_state(*sizes, len(model.suspensions.wheel), len(model.maxwell.time))
    return state, make_work(*sizes, len(model.sensors.body)), make_optional(model, method)


def make_optional(model: Model, method) -> OptionalWork:
    """Allocate the arrays of a method (`integrate.methods`) and, if the model moves in space, of that."""
    n, pitches, wheels = len(model.chain.length), len(model.shoes.link_body), len(model.wheels.x)
    stages = None
    if method.tableau is not None:
        a, b = (np.array(coefficients, dtype=float) for coefficients in method.tableau)
        size = 4 + KINETIC + (2 + len(model.maxwell.time)) * n + 2 * wheels
        own = zeros(start=size, slope=(len(b), size), sensed=(len(b), len(model.sensors.body) + pitches, 3))
        stages = Stages(a, b, **own, **zeros(tooth_impact=2 * pitches, wheel_impact=(pitches, wheels)))
    return OptionalWork(
        space=None if model.space is None else make_space_work(n, wheels),
        implicit=make_implicit(n, wheels) if method.linearly_implicit else None,
        stages=stages,
    )


def make_implicit(n: int, wheels: int) -> ImplicitWork:
    """Allocate the arrays of a linearly implicit sweep."""
    w = wheels
    return ImplicitWork(
        **zeros(inertia=(n, 6), couple=(n, w, 3), wheel_inertia=w, column=(w, 3), gain=(n, w), response=(n, w)),
        **zeros(base=(w, 2), end=(w, 3), row=(w, w + 3), matrix=(w + 2, w + 3), load=w + 3),
    )


def make_space_work(n: int, wheels: int) -> SpaceWork:
    """Allocate the arrays of motion in space."""
    return SpaceWork(
        attitude=np.eye(3),
        **zeros(relative=(wheels, 3, 3), centre=(wheels, 3), gravity=3, force_z=n, moment_x=n, moment_y=n),
        **zeros(acceleration=3, change=3, wheel_load=(wheels, 6), axial=wheels),
    )
