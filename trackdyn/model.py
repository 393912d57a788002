"""Model, state and record of a run as plain tuples of arrays: what every kernel reads and writes.

The model stays constant during a run, the state is carried from step to step, the work arrays are
overwritten by every step, and the record is filled. Nothing is allocated while the time runs.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.chain.riccati import SweepWork, make_work
from trackdyn.contact.laws import Law
from trackdyn.contact.tooth import Tooth

# wheel 0 is the sprocket: its motion is prescribed and links touch its ring
SPROCKET = 0
# rows of the account of work, all in J and counted from the start of the run
SPROCKET_WORK, TOOTH_NORMAL, TOOTH_FRICTION, WHEEL_NORMAL, WHEEL_FRICTION, BEARING, BUSHING_LOSS = range(7)
KINETIC, GRAVITY, BUSHING_ELASTIC = range(7, 10)
ENERGY_NAMES = (
    "sprocket_work",
    "tooth_normal",
    "tooth_friction",
    "wheel_normal",
    "wheel_friction",
    "bearing",
    "bushing_loss",
    "kinetic",
    "gravity",
    "bushing_elastic",
)


class Wheels(NamedTuple):
    """The wheels that links touch: 0 the sprocket's ring, then the others.

    Attributes
    ----------
    present : (w,) integer array
        0: no contact with links (a sprocket without ring).
    x, y, radius, inertia, drag : (w,) arrays
        Centre, radius, moment of inertia, bearing drag; SI. The sprocket's motion is prescribed.
    half_thickness : float
        D/2 of the links, m.
    ring_law, wheel_law : Law
        Links on the sprocket's ring; links on the other wheels.
    """

    present: np.ndarray
    x: np.ndarray
    y: np.ndarray
    radius: np.ndarray
    inertia: np.ndarray
    drag: np.ndarray
    half_thickness: float
    ring_law: Law
    wheel_law: Law


class Shoes(NamedTuple):
    """Where the links and the connectors' arcs sit on the bodies of the chain, for ``p`` pitches.

    Attributes
    ----------
    link_body : (p,) integer array
        Body that carries the link of a pitch.
    link_start, link_end : (p,) arrays
        The ends A and B of the link's middle line on the body's pin line, from its input pin, m.
    arc_body : (2 p,) integer array
        Body that carries the left (even entries) and right (odd) arc of the connector of a pitch.
    arc_x : (2 p,) array
        Their centres on the body's pin line, from its input pin, m.
    """

    link_body: np.ndarray
    link_start: np.ndarray
    link_end: np.ndarray
    arc_body: np.ndarray
    arc_x: np.ndarray


class Closure(NamedTuple):
    """The cut joint: ``compliant`` 0 holds both pins together exactly; 1 is a spring and damper between them.

    ``stiffness`` (N/m) and ``damping`` (N s/m) are those of the elastic-damping cut (A.6).
    """

    compliant: int
    stiffness: float
    damping: float


RIGID = Closure(0, 0.0, 0.0)


class Drive(NamedTuple):
    """Prescribed angular velocity of the sprocket: 0 to ``rate`` in ``ramp`` seconds, then constant."""

    rate: float
    ramp: float


class Sensor(NamedTuple):
    """Body that carries the sensor and the sensor's place in the body frame, m."""

    body: int
    x: float
    y: float


class Model(NamedTuple):
    """Everything that stays constant during a run."""

    chain: Chain
    shoes: Shoes
    tooth: Tooth
    wheels: Wheels
    drive: Drive
    sensor: Sensor
    step: float
    closure: Closure = RIGID


class State(NamedTuple):
    """Everything that a run carries from step to step (written in place).

    Attributes
    ----------
    steps : (1,) integer array
        Steps taken; the time is ``steps * step``.
    pin : (4,) array
        Position and velocity of the input pin of body 1 (m, m/s).
    angle, rate : (n,) arrays
        Orientation (rad) and angular velocity (rad/s) of the bodies.
    wheel_angle, wheel_rate : (w,) arrays
        The same of the wheels.
    tooth_impact : (2 p,) array
        Stored initial impact velocity of the left (even entries) and right (odd) arc of the ``p``
        connectors, 0 without contact, m/s.
    wheel_impact : (p, w) array
        The same for link and wheel.
    work_done : (7,) array
        Account of work, J.
    """

    steps: np.ndarray
    pin: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    wheel_angle: np.ndarray
    wheel_rate: np.ndarray
    tooth_impact: np.ndarray
    wheel_impact: np.ndarray
    work_done: np.ndarray


class Work(NamedTuple):
    """Arrays that a step overwrites.

    ``contact`` holds a row a contact: force normal (x, y), friction (x, y), arm from the body's
    mass centre (x, y), velocity of the body's point (x, y), arm from the wheel's centre (x, y),
    wheel rate, and the slopes of the normal and the friction force that a linearly implicit step
    takes (kg). ``contact_body`` holds body, wheel and 1 for a tooth. ``cut`` is the gap of the cut
    joint and its rate (output pin of the last body less input pin of the first; m, m/s). ``sensed``
    is the sensor's acceleration and angle at the last evaluation and their sums over the sample.
    """

    cos: np.ndarray
    sin: np.ndarray
    pin_x: np.ndarray
    pin_y: np.ndarray
    com_vx: np.ndarray
    com_vy: np.ndarray
    com_dvx: np.ndarray
    com_dvy: np.ndarray
    old_rate: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray
    moment: np.ndarray
    torque: np.ndarray
    joint_rate: np.ndarray
    wheel_torque: np.ndarray
    tooth_force: np.ndarray
    tooth_area: np.ndarray
    tooth_groove: np.ndarray
    wheel_force: np.ndarray
    contact: np.ndarray
    contact_body: np.ndarray
    count: np.ndarray
    cut: np.ndarray
    sensed: np.ndarray
    sweep: SweepWork


class Spells(NamedTuple):
    """Log of the contacts with the sprocket (columns: ``integrate.spells.SPELL_COLUMNS``).

    Attributes
    ----------
    enabled : int
        0: not logged.
    open : (3 p, 11) array
        Spells that have begun and not ended: left arc, right arc and ring of each pitch.
    rows : (m, 11) array
        Ended spells.
    count : (1,) integer array
        Number of ended spells; more than ``m`` if some found no room.
    """

    enabled: int
    open: np.ndarray
    rows: np.ndarray
    count: np.ndarray


class Record(NamedTuple):
    """Arrays that a run fills, one row a sample.

    Attributes
    ----------
    raw, mean : (s, 3) arrays
        Acceleration of the sensor in the link frame (m/s2) and the link's angle (rad): at the start
        of the last step of the sample interval, and averaged over the interval.
    gap : (s,) array
        Largest distance between the two pins of the cut joint in the interval, m.
    place : (s, 2) array
        Middle of the sensor's link, m.
    wheel_rate : (s, w) array
        Angular velocities of the wheels, rad/s.
    energy : (s, 10) array
        See ``ENERGY_NAMES``, J.
    force : (s, p, 3) array
        Normal force of left arc, right arc and ring on the chosen pitches, N.
    area, groove : (s, p, 2) integer arrays
        Area and groove of the left and right arc, 0 without contact.
    pitches : (p,) integer array
        The chosen pitches (0-based).
    frame : (f, n + 3) array
        Configuration every ``frame_stride`` samples: pin x, y, angles, sprocket angle.
    frame_stride : int
        Samples between frames.
    spells : Spells
        Log of the contacts with the sprocket.
    """

    raw: np.ndarray
    mean: np.ndarray
    gap: np.ndarray
    place: np.ndarray
    wheel_rate: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    area: np.ndarray
    groove: np.ndarray
    pitches: np.ndarray
    frame: np.ndarray
    frame_stride: int
    spells: Spells


def make_buffers(n: int, wheels: int, pitches: int | None = None) -> Work:
    """Allocate the arrays of a step for ``n`` bodies, ``wheels`` wheels and ``pitches`` pitches (n / 2 of them)."""
    pitches = n // 2 if pitches is None else pitches
    contacts = 2 * pitches + pitches * wheels
    return Work(
        *(np.zeros(n) for _ in range(2)),
        *(np.zeros(n + 1) for _ in range(2)),
        *(np.zeros(n) for _ in range(10)),
        np.zeros(wheels),
        np.zeros(2 * pitches),
        np.zeros(2 * pitches, np.int64),
        np.zeros(2 * pitches, np.int64),
        np.zeros((pitches, wheels)),
        np.zeros((contacts, 13)),
        np.zeros((contacts, 3), np.int64),
        np.zeros(1, np.int64),
        np.zeros(4),
        np.zeros(6),
        make_work(n),
    )
