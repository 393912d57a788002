"""Arrays that a run fills, and the names of their columns."""

from typing import NamedTuple

import numpy as np

from trackdyn.model.constants import zeros

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
# one uninterrupted contact of an arc or a link with the sprocket
SPELL = np.dtype({
    "names": (
        "pitch",  # 0-based
        "side",  # 0 left arc, 1 right arc, 2 ring
        "groove",
        "areas",  # bit j - 1 set: area j was visited
        "start_s",
        "end_s",  # 0 while nothing is open
        "peak_n",  # between the steps, too
        "peak_s",
        "impulse_ns",
        "square_n2s",  # integral of the squared force
    ),
    "formats": [float] * 10,
})  # fmt: skip


class Spells(NamedTuple):
    """Log of the contacts with the sprocket, a `SPELL` each."""

    enabled: int  # 0: not logged
    # open, last: (3 p,) spells that have begun and not ended, of left arc, right arc and ring of each pitch; (3 p, 2)
    # forces of their last step and of the one before, N
    open: np.ndarray
    last: np.ndarray
    rows: np.ndarray  # (m,) ended spells
    count: np.ndarray  # (1,) integers: number of ended spells; more than ``m`` if some had no room


class PlaneRecord(NamedTuple):
    """Out-of-plane samples of a record, one row a sample."""

    motion: np.ndarray  # (s, 8) offset (m), speed (m/s), p, q (rad/s) and the Euler parameters of the plane
    offset: np.ndarray  # (s, w) where the plane of the chain crosses the axis of every wheel, from its middle, m
    axial: np.ndarray  # (s, w) force on every wheel along its axis, mean over the sample, N


class Record(NamedTuple):
    """One row a sample of what `recording.Recording` describes."""

    # raw, mean, gap, cut, place, wheel_rate, energy, force, area, groove: as in `recording.Recording`
    raw: np.ndarray
    mean: np.ndarray
    gap: np.ndarray
    cut: np.ndarray
    place: np.ndarray
    wheel_rate: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    area: np.ndarray
    groove: np.ndarray
    pitches: np.ndarray  # (p,) integers: pitches whose contacts are recorded (0-based)
    frame: np.ndarray  # (f, n + 3) configuration every ``frame_stride`` samples: pin x, y, angles, sprocket angle
    frame_stride: int  # samples between frames
    spells: Spells  # log of the contacts with the sprocket
    # (s, l, 3) ``mean`` of the sensor's point on every link; none (l = 0) unless asked for
    link_mean: np.ndarray
    sliding: np.ndarray  # (s, k) as in `recording.Recording`; none (k = 0) unless asked for
    plane: PlaneRecord | None = None  # motion of the chain's plane; None in planar motion


def make_record(
    samples: int,
    state,
    pitches=(),
    frames: int = 0,
    frame_stride: int = 0,
    spells: int = 0,
    links: int = 0,
    sliding: int = 0,
) -> Record:
    """Allocate the record of a run of ``samples`` rows, of the bodies, pitches, wheels and plane of ``state``.

    Contacts are recorded of ``pitches`` (1-based), configurations ``frame_stride`` samples apart, with room for so many
    ``spells`` (0: not logged), accelerations of ``links`` links (0: only the sensor's) and ``sliding`` entries of that
    account (0: not kept).
    """
    p, n, (loop, wheels) = len(pitches), len(state.angle), state.wheel_impact.shape
    s, pair, sides = samples, (samples, 2), (samples, p, 2)
    room = {"last": np.zeros((3 * loop, 2)), **zeros(SPELL, open=3 * loop, rows=spells)}
    plane = PlaneRecord(**zeros(motion=(s, 8), offset=(s, wheels), axial=(s, wheels)))
    return Record(
        **zeros(raw=(s, 3), mean=(s, 3), gap=s, cut=pair, place=pair, wheel_rate=(s, wheels)),
        **zeros(energy=(s, 10), force=(s, p, 3), frame=(frames, n + 3), link_mean=(s, links, 3)),
        **zeros(np.int8, area=sides, groove=sides),
        sliding=np.zeros((s, sliding)),
        pitches=np.array([i - 1 for i in pitches], np.int64),
        frame_stride=frame_stride,
        spells=Spells(enabled=int(spells > 0), count=np.zeros(1, np.int64), **room),
        plane=None if state.plane is None else plane,
    )
