"""Replay: repeat a short stretch of a run, with the motion and the forces of every body."""

from dataclasses import dataclass
from math import pi

import numpy as np
from tqdm import tqdm

from trackdyn.inputs.validation import within
from trackdyn.model.arrays import FLANK, GUIDE, RING, Record, components, make_record
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import wheel_names
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording

FRAMES, BODIES_IN_FRAMES = 360, 60_000  # pictures of a stretch, fewer of a chain of many bodies: bounds the page
AT_REST = 3.0  # length of the stretch if the sprocket does not turn, s
LONGEST_STRETCH = 60.0  # s
LEAD_COST, SHORT_LEAD = 6e8, 5.0  # steps times bodies above which the lead-in is shortened; its time at speed, s


@dataclass(frozen=True)
class Replay:
    """Motion and forces of a loop over a stretch; ``f`` pictures, ``n`` bodies, ``w`` wheels."""

    loop: Loop  # at the end of the stretch
    time: np.ndarray  # (f,) of the pictures, since the beginning of the record, s
    interval: float  # between two of them, s
    bodies: np.ndarray  # (f, n, 3) input pin x, y (m) and angle (rad)
    wheels: np.ndarray  # (f, w, 3) centre x, y and radius of the sprocket's ring and the other wheels, m
    turned: np.ndarray  # (f,) angle of the sprocket, rad
    # list of f (k, 9) side, position x, y (m), normal force x, y (N), area and groove (0 without), body, wheel
    contacts: list[np.ndarray]
    tension: np.ndarray  # (f, n) magnitude of the force in the joint behind each body, N
    # (f, n) position of this joint along the loop, in pitches from the first contact with the sprocket
    along: np.ndarray
    spans: np.ndarray  # (w, 2) begin and end of contact with each wheel along the loop, pitches; NaN without contact
    record: Record  # over the stretch, with all pitches
    begin: float  # time since the start of the run at which the stretch begins, s
    # (2,) largest difference from the recording of the sensor's position (m) and its mean acceleration (m/s2); None if
    # the lead-in was shortened
    apart: np.ndarray | None

    @property
    def names(self) -> list[str]:
        """Names of the wheels, with spaces."""
        return [name.replace("_", " ") for name in wheel_names(self.loop.scene.rig)[: self.wheels.shape[1]]]


def replay(recording: Recording, seconds: float | None = None, progress: bool = False) -> Replay:
    """Run the scene of a recording again and return its first ``seconds`` (default: a turn of the sprocket)."""
    scene, period = recording.scene, recording.periods.turn
    rate = scene.rig.rate
    if seconds is None:
        seconds = min(period, LONGEST_STRETCH) if np.isfinite(period) else AT_REST
        seconds = max(min(seconds, recording.seconds), 1 / rate)
    else:
        seconds = within("seconds", seconds, 1 / rate, LONGEST_STRETCH, " s")
    frames = max(2, min(FRAMES, BODIES_IN_FRAMES // scene.bodies))
    stride = max(1, round(seconds * rate / frames))
    frames = max(1, int(seconds * rate / stride + 1e-6))
    loop = Loop(scene)
    complete = (recording.begin - scene.ramp) / scene.time_step * scene.bodies <= LEAD_COST
    begin = recording.begin if complete else scene.ramp + min(scene.lead_in, SHORT_LEAD)
    model, state = loop.model, loop.state
    n, wheels, pitches = len(state.angle), len(model.wheels.x), scene.rig.chain.pitches
    record = make_record(frames * stride, state, len(model.sensors.body), range(1, pitches + 1))
    bodies, around, turned = np.zeros((frames, n, 3)), np.zeros((frames, wheels, 3)), np.zeros(frames)
    tension, contacts = np.zeros((frames, n)), []
    show = "replaying |{bar}| {n:.1f} of {total:.1f} s simulated"
    with tqdm(total=begin + seconds + 1e-6, disable=not progress, bar_format=show) as progress_bar:
        loop.advance(begin, progress_bar.update)
        begin = loop.time
        for k in range(frames):
            loop.fill(record, k * stride, (k + 1) * stride)
            pins = loop.pins  # refreshes the work of this instant
            bodies[k] = np.column_stack([pins[:n], state.angle])
            around[k] = np.column_stack([model.wheels.x, model.wheels.y, model.wheels.radius])
            turned[k] = state.wheel_angle[SPROCKET]
            tension[k] = np.hypot(*loop.joint_forces.T)
            contacts.append(_contacts(loop))
            progress_bar.update(stride / rate)
    first = turned[0] - scene.sprocket_rate * stride / rate
    moved = np.abs(turned - first) / (2 * pi) * model.tooth.teeth
    length = np.cumsum(model.chain.length)
    joints, middles = (places / length[-1] * pitches for places in (length, length - model.chain.length / 2))
    spans, origin = _spans(contacts, middles, moved, wheels, pitches)
    rows, sensors = record.samples, len(model.sensors.body)
    both = min(len(rows.gap), len(recording.time))
    distance = np.abs(rows.link_position[:both] - recording.link_position[:both]).max()
    apart = np.array([distance, np.abs((rows.mean[:both] - recording.mean[:both, :sensors])[..., :2]).max()])
    return Replay(
        loop, np.arange(1, frames + 1) * stride / rate, stride / rate, bodies, around, turned, contacts, tension,
        (joints + moved[:, None] - origin) % pitches, spans, record, begin, apart if complete else None,
    )  # fmt: skip


def _contacts(loop: Loop) -> np.ndarray:
    """Return the (k, 9) contacts of the present state; see `Replay`."""
    work = loop.work
    rows = work.contact[: work.count[0]]
    rows = rows[(rows["kind"] != GUIDE) & components(rows, "normal").any(axis=1)]
    points = loop.mass_centres[rows["body"]] + components(rows, "arm")
    side, flank = np.where(rows["kind"] == RING, 2, 2 + rows["wheel"]), rows["kind"] == FLANK
    arc = rows["slot"][flank]
    side[flank] = arc % 2
    area, groove = np.zeros((2, len(rows)))
    area[flank], groove[flank] = work.tooth_area[arc], work.tooth_groove[arc]
    return np.column_stack([side, points, components(rows, "normal"), area, groove, rows["body"], rows["wheel"]])


def _spans(contacts, middles, moved, wheels: int, pitches: int) -> tuple[np.ndarray, float]:
    """Return `Replay.spans` and their origin along the loop: the first contact with the sprocket."""
    spans = np.full((wheels, 2), np.nan)
    bodies, touched = np.concatenate(contacts)[:, 7:].astype(int).T
    along = (middles[bodies] + np.repeat(moved, [len(rows) for rows in contacts])) % pitches
    for wheel in range(wheels):
        ways = np.sort(along[touched == wheel])
        if len(ways):
            gaps = np.diff(np.append(ways, ways[0] + pitches))
            begin = ways[(np.argmax(gaps) + 1) % len(ways)]
            spans[wheel] = begin, begin + pitches - gaps.max()
    origin = np.nan_to_num(spans[SPROCKET, 0])
    begins = (spans[:, 0] - origin) % pitches
    return np.column_stack([begins, begins + np.diff(spans, axis=1)[:, 0]]), float(origin)
