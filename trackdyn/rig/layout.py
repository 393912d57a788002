"""Layout of the loop: the belt path around the wheels and the chain laid along it.

The chain runs clockwise with its bodies numbered along the run: the left arc of a connector (at its input pin) trails,
and a link's y axis points outward.
"""

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import combinations
from math import atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.rig.rig import Rig
from trackdyn.rig.roots import root

CLEAR = 0.02  # m, least allowed distance of a wheel from the taut chain; or the sag of its longest strand
LEAST_LEVER = 0.05  # least lengthening of the path per shift of the tensioner
ONE_LINE = 1e-9  # rad, angle between runs to two wheels on one line
CONVEX_ORDER = "the wheels must stand in clockwise order on a convex path"  # remedy
MOST_STEPS, LAST_STEP = 40, 1e-9  # of Newton's method (four are usual), m: the error is its square


@dataclass(frozen=True)
class BeltPath:
    """Clockwise path of external tangents and arcs around circles given in clockwise order."""

    circles: np.ndarray  # (w, 3) centre x, y and radius of each circle, m
    heading: np.ndarray  # (w,) direction of the straight run that leaves each circle, rad
    start: np.ndarray  # (2 w + 1,) arc length at which arc 0, run 0, arc 1, run 1, ... begin, and the whole length, m
    wrap: np.ndarray  # (w,) angle covered on each circle, rad

    @property
    def length(self) -> float:
        """Length of the whole path, m."""
        return float(self.start[-1])

    def sag(self, weight: float) -> float:
        """Return the excess length of a sagging chain of ``weight`` (N/m), ``w^2 l^3 / 24 T^2`` a run, times T^2."""
        return weight**2 * float((np.diff(self.start)[1::2] ** 3).sum()) / 24

    def along(self, s):
        """Return positions (k, 2), headings (rad) and curvatures (1/m, positive clockwise) at arc lengths ``s``."""
        s = np.asarray(s, dtype=float) % self.length
        piece = np.minimum(np.searchsorted(self.start, s, side="right") - 1, 2 * len(self.wrap) - 1)
        wheel, on_run = piece // 2, piece % 2 == 1
        x, y, r = self.circles[wheel].T
        ds = s - self.start[piece]
        heading = self.heading[wheel] + np.where(on_run, 0.0, self.wrap[wheel] - ds / r)
        further, c, s = np.where(on_run, ds, 0.0), np.cos(heading), np.sin(heading)
        point = np.column_stack([x - r * s + further * c, y + r * c + further * s])
        return point, heading, np.where(on_run, 0.0, 1.0 / r)


def belt_path(circles, names=None) -> BeltPath:
    """Return the belt around circles ``(x, y, radius)`` in clockwise order, starting at the first; or `InputError`.

    ``names`` are for error messages; neighbours may overlap as wheels side by side on their axles do.
    """
    circles = np.asarray(circles, dtype=float)
    names = names or [str(i + 1) for i in range(len(circles))]
    dx, dy, wider = (np.roll(circles, -1, axis=0) - circles).T
    distance = np.hypot(dx, dy)
    if (contained := distance <= np.abs(wider)).any():
        i = int(contained.argmax())
        apart = f"wheels {names[i]} and {names[(i + 1) % len(names)]} are {distance[i]:.4g} m apart"
        raise InputError(f"{apart} and overlap with the chain on them; the distance must exceed {abs(wider[i]):.4g} m")
    heading = np.arctan2(dy, dx) + np.arcsin(wider / distance)
    wrap = (np.roll(heading, 1) - heading) % (2 * pi)
    if abs(wrap.sum() - 2 * pi) > 1e-9:
        worst = int(np.argmax(wrap))
        untouched = f"wheel {names[worst]} at ({circles[worst, 0]:.4g}, {circles[worst, 1]:.4g}) m"
        raise InputError(f"{untouched} would not touch the loop; {CONVEX_ORDER}")
    pieces = np.column_stack([wrap * circles[:, 2], np.sqrt(distance**2 - wider**2)]).ravel()
    return BeltPath(circles, heading, np.concatenate([[0.0], np.cumsum(pieces)]), wrap)


def wheel_circles(rig: Rig, shift: float = 0.0, surface: bool = False, body: float | None = None) -> np.ndarray:
    """Return centres and radii (w, 3) of the wheels, the tensioning wheel shifted by ``shift``; m.

    Radii are those of the pins of bodies of this length, by default links, or with ``surface`` the wheels' own.
    """
    body, angle = rig.chain.link_length if body is None else body, rig.tension.direction * pi / 180
    wheels = [(wheel.x, wheel.y, wheel.radius) for wheel in rig.wheels.values()]
    circles = np.array([(rig.sprocket.x, rig.sprocket.y, rig.sprocket.ring_radius), *wheels])
    circles[tensioner(rig), :2] += [shift * cos(angle), shift * sin(angle)]
    if not surface:
        circles[:, 2] = np.hypot(circles[:, 2] + rig.chain.link_thickness / 2, body / 2)
    return circles


def wheel_names(rig: Rig) -> tuple[str, ...]:
    """Return the names of all wheels in the order of a model's, the sprocket first."""
    return ("sprocket", *rig.wheels)


def run_order(circles: np.ndarray) -> list[int]:
    """Return wheels in the order in which a taut clockwise chain around all of them meets them, the sprocket (0) first.

    From the highest circle on the chain leaves every wheel to the one that bends its run least; of wheels on one line
    the nearest comes first. A large wheel between smaller ones may be met twice, wheels within not at all.
    """
    x, y, r = circles.T
    wheel, heading, turned = int(np.argmax(y + r)), 0.0, 0.0
    order = []
    for _ in range(2 * len(circles) + 1):
        order.append(wheel)
        dx, dy, wider = x - x[wheel], y - y[wheel], r - r[wheel]
        distance = np.hypot(dx, dy)
        others = np.flatnonzero(distance > np.abs(wider))
        if not len(others):
            break
        tangent = np.arctan2(dy[others], dx[others]) + np.arcsin(wider[others] / distance[others])
        bend = (heading - tangent + ONE_LINE) % (2 * pi)
        in_line = np.flatnonzero(bend <= bend.min() + ONE_LINE)
        k = in_line[np.argmin(distance[others[in_line]])]
        turned += float(bend[k]) - ONE_LINE
        if turned > 2 * pi - 1e-6:
            break
        wheel, heading = int(others[k]), float(tangent[k])
    if len(order) > 1 and order[0] == order[-1]:
        order.pop()
    first = order.index(0) if 0 in order else 0
    return order[first:] + order[:first]


def belt_around(rig: Rig, shift: float = 0.0, body: float | None = None) -> tuple[BeltPath, list[int]]:
    """Return the path of the pins around the wheels, and the index in `wheel_names` of each circle; or `InputError`."""
    circles, names = wheel_circles(rig, shift, body=body), wheel_names(rig)
    check_overlap(rig, circles[:, :2])
    order = run_order(circles)
    if order[0] != 0:
        remedy = "the other wheels must leave it on the outline of the loop"
        raise InputError(f"sprocket: the taut chain does not touch it; {remedy}")
    path = belt_path(circles[order], [names[i] for i in order])
    for i in set(range(len(circles))) - set(order):
        # distance of the wheel from the taut chain, and sag of the longest strand
        points, (weight, span) = path.along(np.linspace(0.0, path.length, 4001))[0], longest_strand(rig, path)
        clear = float(np.hypot(*(points - circles[i, :2]).T).min() - circles[i, 2])
        allowed = max(weight * span**2 / (8 * max(rig.tension.pre_tension, weight * span)), CLEAR)
        if clear > allowed:
            wheel = f"wheel {names[i]} at ({circles[i, 0]:.4g}, {circles[i, 1]:.4g}) m would not touch the loop"
            passing = f"the taut chain passes it by at {clear:.4g} m and sags by no more than {allowed:.3g} m"
            raise InputError(f"{wheel}: {passing}; {CONVEX_ORDER}")
    return path, order


def check_overlap(rig: Rig, centres: np.ndarray) -> None:
    """Raise `InputError` if wheels with their centres (w, 2) (m) overlap."""
    solid, names = wheel_circles(rig, surface=True)[:, 2], wheel_names(rig)
    for i, k in combinations(range(len(centres)), 2):
        distance, needed = hypot(*(centres[i] - centres[k])), _needed(solid, i, k)
        # the end of a travel (`travel_range`) is such a distance
        if distance < needed * (1 - 1e-9):
            pair = f"wheels {names[i]} (radius {solid[i]:.4g} m) and {names[k]} ({solid[k]:.4g} m)"
            raise InputError(f"{pair} are {distance:.4g} m apart and overlap; the distance must exceed {needed:.4g} m")


def _needed(solid: np.ndarray, i: int, k: int) -> float:
    """Return the least distance (m) of the centres of two wheels; side by side one may reach the other's axle."""
    return float(solid[i] + solid[k] if 0 in (i, k) else max(solid[i], solid[k]))


def travel_range(rig: Rig, shift: float) -> tuple[float, float]:
    """Return the ends of the tensioner's travel (m), cut where its wheel, moved from ``shift``, would meet another."""
    low, high = -rig.tension.travel, rig.tension.travel
    circles, moved, angle = wheel_circles(rig, surface=True), tensioner(rig), rig.tension.direction * pi / 180
    for k in set(range(len(circles))) - {moved}:
        dx, dy = circles[moved, :2] - circles[k, :2]
        along, sideways = dx * cos(angle) + dy * sin(angle), dy * cos(angle) - dx * sin(angle)
        needed = _needed(circles[:, 2], moved, k)
        if abs(sideways) < needed:
            half = sqrt(needed**2 - sideways**2)
            low, high = (max(low, half - along), high) if shift > -along else (low, min(high, -half - along))
    return low, high


def tensioner(rig: Rig) -> int:
    """Return the index of the tensioning wheel."""
    return wheel_names(rig).index(rig.tension.wheel)


@lru_cache(maxsize=32)  # the loop is laid, as long as a scene is made otherwise
def braked_wheel(rig: Rig, chain: str = "double_pin") -> tuple[int, float]:
    """Return the wheel that a load brakes, as its index in `wheel_names`, and the lever (m) of the chain about it.

    A load is the difference of the tensions of the two strands at the wheel: of those that turn freely the one with the
    largest wrap, where friction carries most. The lever is ``p / phi``: the chain moves by a pitch p while links that
    do not slide turn the wheel by ``phi``, the angle of a pitch with its pins on one circle.
    """
    lengths = body_lengths(rig, chain)
    laid = assemble(rig, lengths)
    wheel = 1 + int(np.argmax(np.bincount(laid.order, laid.path.wrap)[1:]))
    pitch = lengths[: len(lengths) // rig.chain.pitches]
    pins = wheel_circles(rig, body=float(lengths[0]))[wheel, 2]
    return wheel, float(pitch.sum() / (2 * np.arcsin(pitch / (2 * pins))).sum())


def _lay(path: BeltPath, lengths: np.ndarray) -> np.ndarray:
    """Return arc lengths (n + 1,) of the pins of a chain whose chords have their exact lengths, m; or `InputError`."""
    # the cut joint is in the middle of the last run, where its load is the tension of that strand
    s = 0.5 * (path.start[-2] + path.start[-1]) + np.concatenate([[0.0], np.cumsum(lengths)])
    for _ in range(MOST_STEPS):  # Newton's method; a pin stays 0.5 to 1.6 chords after the one before it
        pins, heading, _ = path.along(s)
        apart, tangent = np.diff(pins, axis=0), np.column_stack([np.cos(heading), np.sin(heading)])
        chord = np.hypot(*apart.T)
        # derivatives of a chord by the arc lengths of its two pins, but for the sign of the first
        sides = tangent[:-1], tangent[1:]
        behind, ahead = ((apart * side).sum(axis=1) / np.maximum(chord, LAST_STEP) for side in sides)
        moves = [0.0]
        for missing, first, second in zip((lengths - chord).tolist(), behind.tolist(), ahead.tolist(), strict=True):
            moves.append((missing + first * moves[-1]) / (second or 1.0))  # 0: straight across the path
        s[1:] = s[0] + np.cumsum(np.clip(np.diff(s + moves), 0.5 * lengths, 1.6 * lengths))
        if np.abs(moves).max() < LAST_STEP:
            return s
    body = f"a body of {lengths.max():g} m from pin to pin (chain.link_length, or the connector that fits to it)"
    remedy = f"it must be a fraction of their smallest radius, {path.circles[:, 2].min():.4g} m"
    raise InputError(f"{body} cannot be laid around these wheels; {remedy}")


@dataclass(frozen=True)
class Assembly:
    """Chain laid around the wheels."""

    pins: np.ndarray  # (n, 2) input pins of the bodies, m
    angle: np.ndarray  # (n,) unwrapped orientation of the bodies, falling by 2 pi around the loop, rad
    sprocket_angle: float  # angle of the sprocket with a groove under the connector in the middle of the wrap, rad
    shift: float  # shift of the tensioning wheel that makes the rigid loop just close, m
    lever: float  # derivative of the path's length by that shift
    path: BeltPath  # path of the pins around the wheels
    order: list[int]  # wheels in the order in which the path meets them


def body_lengths(rig: Rig, chain: str = "double_pin") -> np.ndarray:
    """Return pin-to-pin lengths of the bodies of a chain: links and connectors in turn, or one body a pitch, m."""
    if chain == "single_pin":
        return np.full(rig.chain.pitches, rig.single_pin_pitch)
    return np.tile([rig.chain.link_length, rig.connector_length], rig.chain.pitches)


def longest_strand(rig: Rig, path: BeltPath) -> tuple[float, float]:
    """Return the weight of a chain of links and connectors (N/m), and its longest run between two wheels (m)."""
    c = rig.chain
    weight = rig.gravity * (c.link_mass + c.connector_mass) / (c.link_length + rig.connector_length)
    return weight, float(np.diff(path.start)[1::2].max())


def _lever(rig: Rig, path: BeltPath, order: list[int]) -> float:
    """Return the derivative of the path's length by the tensioner's shift; `InputError` if the direction gives none."""
    growth, tension, angle = np.zeros(2), rig.tension, rig.tension.direction * pi / 180
    for k, wheel in enumerate(order):
        if wheel == tensioner(rig):
            enter, leave = path.heading[k - 1], path.heading[k]
            growth += [cos(enter) - cos(leave), sin(enter) - sin(leave)]
    lever = float(growth @ [cos(angle), sin(angle)])
    if abs(lever) < LEAST_LEVER:
        effect = f"moves the {tension.wheel} along its chain and cannot tension it"
        middle = f"{atan2(growth[1], growth[0]) * 180 / pi % 360:.0f} deg, the middle of its wrap"
        raise InputError(f"tension.direction = {tension.direction:g} deg {effect}; choose a direction near {middle}")
    return lever


def can_close(rig: Rig) -> bool:
    """Return whether the loop of links and connectors closes within the tensioner's travel, without `assemble`."""
    try:
        ends = [_slack(rig, body_lengths(rig), shift) for shift in (-rig.tension.travel, rig.tension.travel)]
    except InputError:  # wheels overlap
        return False
    return ends[0] * ends[1] <= 0


def _slack(rig: Rig, lengths: np.ndarray, shift: float) -> float:
    """Return the length of the chain on the path less that of the path, with the tensioning wheel shifted, m."""
    path, _ = belt_around(rig, shift, float(lengths[0]))
    s = _lay(path, lengths)
    return (s[-1] - s[0]) - path.length


def assemble(rig: Rig, lengths: np.ndarray | None = None) -> Assembly:
    """Lay the loop around the wheels by shifting the tensioning wheel until the chain just closes; or `InputError`.

    ``lengths`` are the pin to pin lengths of the bodies, m; by default of links and connectors. Grooves are put under
    connectors, or joints of one body a pitch.
    """
    lengths = body_lengths(rig) if lengths is None else lengths
    single, body, travel = len(lengths) == rig.chain.pitches, float(lengths[0]), rig.tension.travel
    slack = partial(_slack, rig, lengths)
    try:
        shift = root(slack, -travel, travel, 1e-13)
    except ValueError:
        nearest = min(slack(-travel), slack(travel), key=abs)
        state = "long" if nearest > 0 else "short"
        path, order = belt_around(rig, 0.0, body)
        _lever(rig, path, order)
        needed = round(rig.chain.pitches * path.length / float(lengths.sum()))
        same = needed == rig.chain.pitches
        remedy = f"turn tension.direction = {rig.tension.direction:g} deg" if same else f"use about {needed} pitches"
        loop = f"the loop of {rig.chain.pitches} pitches (chain.pitches) is {abs(nearest):.4g} m too {state}"
        problem = f"{loop} for its wheels even at the end of tension.travel = {travel} m"
        pitch = f"one pitch is {1e3 * rig.pitch:.4g} mm, unless chain.pitch states another"
        raise InputError(f"{problem}; {pitch}: {remedy}, move the wheels or enlarge the travel") from None
    path, order = belt_around(rig, shift, body)
    lever = _lever(rig, path, order)
    pins = path.along(_lay(path, lengths))[0]
    step = np.diff(pins, axis=0)
    angle = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    middle = (pins[:-1] if single else 0.5 * (pins[:-1] + pins[1:])[1::2]) - [rig.sprocket.x, rig.sprocket.y]
    direction = path.heading[0] + path.wrap[0] / 2 + pi / 2
    on_wheel = np.arctan2(middle[:, 1], middle[:, 0])
    away = np.hypot(*middle.T) > 1.2 * path.circles[0, 2]
    distance = np.abs((on_wheel - direction + pi) % (2 * pi) - pi) + 10 * away
    under_groove = float(on_wheel[np.argmin(distance)] - pi / rig.sprocket.teeth)
    return Assembly(pins[:-1], angle, under_groove, float(shift), lever, path, order)
