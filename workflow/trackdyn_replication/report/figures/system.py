"""Figures 1 to 4 and 16: the system and its model, its chain and the chain's elements, contact surfaces, the set-up."""

from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon
from matplotlib.path import Path

from trackdyn.contact.laws import closest_point
from trackdyn.measure.columns import words
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, ORANGE, SMALL, VERMILION, new_figure, styled
from trackdyn.rig.layout import belt_path, wheel_circles, wheel_names
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import build_chain
from trackdyn_replication.report import marks
from trackdyn_replication.report.figures.groove import seated_pins

TOUCH = 1e-3  # gap that still counts as touching in a loop that is laid without forces, m
GROUND = 0.18  # depth of the ground under the lowest pin, m
# a contact in the legend
ZIGZAG = Path([(-3, 0), (-2, 0), *((-1.75 + 0.5 * i, 0.4 * (-1) ** i) for i in range(8)), (2, 0), (3, 0)])
WIRE = {"markerfacecolor": "none", "markeredgecolor": BLACK, "markeredgewidth": 0.8}
BOX = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}  # behind the names of the wheels
ON_CHAIN = {"color": BLUE, "linestyle": "-", "linewidth": 2.4}
ON_WHEEL = {"color": VERMILION, "linestyle": (0, (3, 1)), "linewidth": 2.4}
# radii of a pin and of the hole with its bushing, in parts of the link's half thickness; for the eye only
PIN, HOLE = 0.4, 0.65
ENLARGED = 5  # the free angle of the bushings, which would hardly be seen
# face of a body in the topology, its name in the legend
KINDS = {
    "link": (drawing.LINK, "link"), "connector": (drawing.CONNECTOR, "connector with two pins"),
    "pitch": ("#d9e7d3", "one body per pitch"),
}  # fmt: skip
EVERY = 10  # every tenth element of a long chain is numbered


@styled
def system_figure(rig: Rig) -> Figure:
    """Draw Figure 1: the loop on its wheels (a) and the model: bodies, joints and contacts (b)."""
    frame, shift = drawing.laid_frame(rig)
    figure = new_figure(6.9)
    system, model = figure.subplots(2, 1, sharex=True, sharey=True)
    drawing.draw_loop(system, rig, frame, shift, rig.sprocket.ring_radius)
    _draw_base(system, rig, frame, shift)
    ring = "\nwith ring" if rig.ring_radius else ""
    for name, (x, y, _) in zip(wheel_names(rig), wheel_circles(rig, shift, surface=True), strict=True):
        marks.write_mark(system, (x, y + 0.13), f"{words(name)}{ring * (name == 'sprocket')}", bbox=BOX)
    pins, _, _ = drawing.chain_points(rig, frame)
    low, side = pins[:, 1].min() - GROUND, _side(rig)
    for first, fraction, name, offset in ((0, 0.6, "track link", -0.12), (1, 0.25, "connector", 0.14)):
        body = _above(rig, pins, first, fraction)
        middle = 0.5 * (pins[body] + pins[body + 1])
        marks.leader(system, middle, name, middle + [side * offset, 0.14])
    marks.write_mark(system, (pins[:, 0].mean(), low - 0.1), "base")
    corner = pins[:, 0].min() if side > 0 else pins[:, 0].max() - 0.2  # above the wheels, which stand lower
    marks.axes_cross(system, (corner, pins[:, 1].max() - 0.1), 0.2, 0.0, ("$X$", "$Y$"))
    system.set_title(f"(a) system: {rig.chain.pitches} links and connectors on three wheels")
    _draw_model(model, rig, frame, shift)
    for ax in (system, model):
        ax.set(xlim=(pins[:, 0].min() - 0.12, pins[:, 0].max() + 0.12), ylim=(low - 0.16, pins[:, 1].max() + 0.24))
        marks.bare(ax)
    model.set_title("(b) model: bodies, joints, contacts")
    return figure


def _side(rig: Rig) -> int:
    """Return 1 if the sprocket is to the right of the wheels, else -1."""
    return 1 if rig.sprocket.x > np.mean([wheel.x for wheel in rig.wheels.values()]) else -1


def _above(rig: Rig, pins, first: int, fraction: float) -> int:
    """Return the link (``first`` 0) or connector (1) of the upper strand at a fraction of the way to the next wheel."""
    middles = 0.5 * (pins[:-1] + pins[1:])
    nearest = min((wheel.x for wheel in rig.wheels.values()), key=lambda x: abs(x - rig.sprocket.x))
    away = np.abs(middles[:, 0] - rig.sprocket.x - fraction * (nearest - rig.sprocket.x))
    away[middles[:, 1] < rig.sprocket.y] = np.inf
    return 2 * int(np.argmin(away[first::2])) + first


def _draw_base(ax: Axes, rig: Rig, frame, shift: float) -> None:
    """Draw the ground, and the posts that hold the wheels' bearings."""
    pins = drawing.chain_points(rig, frame)[0]
    low = pins[:, 1].min() - GROUND
    for x, y, _ in wheel_circles(rig, shift):
        post = [[x - 0.02, y], [x + 0.02, y], [x + 0.05, low], [x - 0.05, low]]
        ax.add_patch(Polygon(post, facecolor="0.75", edgecolor="0.3", linewidth=0.6, zorder=drawing.Z_RING - 0.5))
    ends = pins[:, 0].min(), pins[:, 0].max()
    ax.plot(ends, (low, low), "-", color=BLACK, linewidth=1.4)
    for x in np.linspace(*ends, 60):
        ax.plot((x, x - 0.025), (low, low - 0.03), "-", color=BLACK, linewidth=0.5)


def touching_links(rig: Rig, frame, shift: float) -> list[tuple[int, int, np.ndarray]]:
    """Return body, wheel (index in `wheel_names`) and contact point Q (m) of every link that lies on a wheel."""
    pins, _, _ = drawing.chain_points(rig, frame)
    touching = []
    for wheel, (x, y, r) in enumerate(wheel_circles(rig, shift, surface=True)):
        near = []
        for body in range(0, len(pins) - 1, 2):
            _, qx, qy, distance = closest_point(*map(float, (*pins[body], *pins[body + 1], x, y)))
            near.append((distance - r - rig.chain.link_thickness / 2, body, np.array([qx, qy])))
        gap = max(TOUCH, min(gap for gap, *_ in near))  # before the loop has settled a wheel may have no link
        touching += [(body, wheel, q) for distance, body, q in near if distance <= gap]
    return touching


def _draw_model(ax: Axes, rig: Rig, frame, shift: float) -> None:
    pins, _, _ = drawing.chain_points(rig, frame)
    circles = wheel_circles(rig, shift, surface=True)
    _draw_base(ax, rig, frame, shift)
    looks = [("link", {"color": BLUE, "linewidth": 3.0}), ("connector", {"color": ORANGE, "linewidth": 1.6})]
    for first, (_, look) in enumerate(looks):
        for body in range(first, len(pins) - 1, 2):
            ax.plot(*pins[body : body + 2].T, "-", **look, zorder=drawing.Z_LINK)
    joint = {"linestyle": "none", "marker": "o", "markerfacecolor": "white", "color": BLACK, "markersize": 3.5}
    ax.plot(*pins[1:-1].T, **joint, zorder=drawing.Z_MARK)
    cut = {"linestyle": "none", "marker": "X", "color": VERMILION, "markeredgecolor": BLACK, "markersize": 8}
    ax.plot(*pins[0], **cut, zorder=drawing.Z_MARK + 1)
    bearing = joint | {"marker": "o", "markersize": 8}
    for x, y, r in circles:
        # drawn small, so that the contacts are seen
        ax.add_patch(Circle((x, y), 0.6 * r, facecolor="0.93", edgecolor=BLACK, linewidth=1.0, zorder=drawing.Z_RING))
        ax.plot(x, y, **bearing, zorder=drawing.Z_MARK)
    contact = {"color": BLACK, "linewidth": 0.8, "linestyle": "-"}
    tooth = {"color": VERMILION, "linewidth": 1.1, "linestyle": (0, (2, 1))}
    sway = 0.012 * np.array([0, 0, *([1, -1] * 4), 0, 0])  # of a zigzag from the wheel as drawn to the link
    for _, wheel, q in touching_links(rig, frame, shift):
        centre = circles[wheel, :2]
        along, left = marks.directions(centre, q)
        reach = np.linspace(0.6 * circles[wheel, 2], np.hypot(*(q - centre)), 12)
        spring = centre + np.outer(reach, along) + np.outer(sway, left)
        marks.line(ax, *spring, **contact, zorder=drawing.Z_CONNECTOR)
    away = np.hypot(*(pins[:-1] - drawing.sprocket_centre(rig)).T)
    reach = rig.groove_profile.addendum + rig.chain.connector_radius  # Eq. 18
    for pin in np.flatnonzero(away <= reach):
        start = circles[0, :2] + 0.6 * circles[0, 2] * marks.directions(circles[0, :2], pins[pin])[0]
        marks.line(ax, start, pins[pin], **tooth, zorder=drawing.Z_CONNECTOR)
    looks += [
        ("revolute joint with bushing", joint),
        ("cut joint", cut),
        ("bearing on the base", bearing),
        ("contact of link and wheel", {"linestyle": "none", "marker": ZIGZAG, "markersize": 18} | WIRE),
        ("arc within reach of the teeth", tooth),
    ]
    handles = [marks.handle(name, **look) for name, look in looks]
    ax.figure.legend(handles=handles, loc="outside lower center", ncols=2)


@styled
def locations_figure(rig: Rig) -> Figure:
    """Draw Figure 4, contact surfaces: connector and groove (a), link and ring (b), and the next two wheels (c, d)."""
    frame, shift = drawing.laid_frame(rig)
    figure = new_figure(3.6)
    axes = figure.subplots(2, 2).ravel()
    _draw_seat(axes[0], rig)
    axes[0].set_title("(a) connector and groove")
    wheels = {wheel for _, wheel, _ in touching_links(rig, frame, shift)}
    for wheel, (ax, name, letter) in enumerate(zip(axes[1:], wheel_names(rig), "bcd", strict=False)):
        if wheel in wheels:
            _draw_link_on(ax, rig, frame, shift, wheel)
        ax.set_title(f"({letter}) link and {words(name) if wheel else 'rubber ring'}")
    for ax in axes[1 + len(wheel_names(rig)) :]:
        ax.set_axis_off()
    handles = [marks.handle("surface of the chain", **ON_CHAIN), marks.handle("surface that it touches", **ON_WHEEL)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _draw_seat(ax: Axes, rig: Rig) -> None:
    """Draw a connector at rest in its groove, both arcs and the ten areas emphasized."""
    home = rig.changed(sprocket__x=0.0, sprocket__y=0.0)
    beta = pi / rig.sprocket.teeth - pi / 2  # angle of groove 1 (Eq. 12), which points up
    drawing.draw_sprocket(ax, home, -beta, None)
    pins = seated_pins(rig)
    look = {"facecolor": drawing.CONNECTOR, "alpha": 0.85, "zorder": drawing.Z_CONNECTOR}
    ax.add_patch(drawing.connector_patch(rig, pins, **look))
    end = drawing.circle_points((0.0, 0.0), rig.chain.connector_radius, pi / 2, 3 * pi / 2, 40)
    for pin, flip in zip(pins, (1, -1), strict=True):
        marks.line(ax, *(pin + end * [flip, 1]), **ON_CHAIN)
        marks.point(ax, pin)
    marks.line(ax, *drawing.groove_points(home, -beta, 1, rig.groove_profile.profile()), **ON_WHEEL)
    _close_view(ax, np.array([0.0, pins[0, 1] - 0.3 * rig.chain.connector_radius]))
    marks.write_mark(ax, pins.mean(axis=0) + [0.0, 0.013], "connector")
    marks.write_mark(ax, pins.mean(axis=0) - [0, 1.9 * rig.chain.connector_radius], "sprocket")


def _draw_link_on(ax: Axes, rig: Rig, frame, shift: float, wheel: int) -> None:
    """Draw a link in the middle of those on a wheel, rotated so that it lies on top."""
    on_it = [(body, q) for body, on, q in touching_links(rig, frame, shift) if on == wheel]
    body, q = on_it[len(on_it) // 2]
    x, y, r = wheel_circles(rig, shift, surface=True)[wheel]
    angle = pi / 2 - np.arctan2(*(q - [x, y])[::-1])
    # move the wheel's centre to the sprocket's, then turn everything about it
    centre = drawing.sprocket_centre(rig)
    view = np.array(frame)
    view[:2] += centre - [x, y]
    view = drawing.turned(rig, view, angle)
    if wheel == 0:
        drawing.draw_sprocket(ax, rig, view[-1], r)
    else:
        for size, face, edge in ((r, drawing.RUBBER, BLACK), (0.9 * r, drawing.STEEL, drawing.STEEL_EDGE)):
            ax.add_patch(Circle(centre, size, facecolor=face, edgecolor=edge, zorder=drawing.Z_RING))
    drawing.draw_chain(ax, rig, view, opacity=0.85)
    for bodies in ax.collections:  # connectors are next to ring and tyres: drawn behind them
        if bodies.get_zorder() == drawing.Z_CONNECTOR:
            bodies.set_zorder(drawing.Z_RING - 0.5)
    pins, angles, _ = drawing.chain_points(rig, view)
    lower = drawing.placed(drawing.link_outline(rig)[:2], pins[body], angles[body])
    marks.line(ax, *lower, **ON_CHAIN, zorder=drawing.Z_MARK + 1)
    ends = (pi / 2 + fraction * rig.chain.link_length / r for fraction in (0.75, -0.75))
    marks.line(ax, *drawing.circle_points(centre, r, *ends, 80), **ON_WHEEL)
    middle = 0.5 * (pins[body] + pins[body + 1])
    _close_view(ax, middle - [0.0, 0.5 * rig.chain.link_thickness])
    marks.write_mark(ax, middle, "link")
    marks.write_mark(ax, centre + [-0.03, r - 0.042], words(wheel_names(rig)[wheel]))
    if wheel == 0:
        marks.leader(ax, centre + (r - 0.009) * marks.polar(pi / 2 - 0.15), "ring", centre + [0.06, r - 0.042])


def _close_view(ax: Axes, middle) -> None:
    drawing.view(ax, middle, (0.115, 0.07))
    marks.bare(ax)


@styled
def setup_figure(rig: Rig) -> Figure:
    """Draw Figure 16: motor, rig, sensor on the selected link, signal collection and computer."""
    frame, shift = drawing.laid_frame(rig)
    side, pins = _side(rig), drawing.chain_points(rig, frame)[0]
    body = _above(rig, pins, 0, 0.5)  # where the selected link may be seen
    figure = new_figure(3.5)
    ax = figure.subplots()
    drawing.draw_loop(ax, rig, frame, shift, rig.sprocket.ring_radius, highlight=(body,))
    _draw_base(ax, rig, frame, shift)
    angles = drawing.chain_points(rig, frame)[1]
    sensor = drawing.placed([[rig.first_sensor.x, rig.first_sensor.y]], pins[body], angles[body])[0]
    up = marks.polar(angles[body] + pi / 2)
    box = drawing.placed([[-0.025, 0.0], [0.025, 0.0], [0.025, 0.04], [-0.025, 0.04]], sensor, angles[body])
    ax.add_patch(Polygon(box, facecolor=ORANGE, edgecolor=BLACK, zorder=drawing.Z_MARK))
    for name, start in (("x", -0.0), ("y", pi / 2)):
        end = sensor + 0.02 * up + 0.16 * marks.polar(angles[body] + start)
        marks.arrow(ax, sensor + 0.02 * up, end, color=BLACK, linewidth=1.0)
        marks.write_mark(ax, end + 0.03 * marks.polar(angles[body] + start), f"${name}$")
    text = f"wireless acceleration sensor on link {rig.first_sensor.pitch}\n"
    text += f"{rig.rate} Hz, \N{PLUS-MINUS SIGN}{rig.first_sensor.range:g} g"
    marks.leader(ax, sensor + 0.04 * up - [0.02 * side, 0.0], text, sensor + [-0.55 * side, 0.36])
    half, ends = np.array([0.22, 0.12]), (pins[:, 0].min(), pins[:, 0].max())
    x = ends[side > 0] + 0.36 * side  # position of the boxes, next to the sprocket
    motor, collection, computer = rig.sprocket.y - 0.15, sensor[1] + 0.36, sensor[1]
    for name, y in (("motor", motor), ("signal\ncollection", collection), ("computer", computer)):
        look = {"boxstyle": "square,pad=0", "facecolor": "#dcebf5", "edgecolor": BLACK, "zorder": drawing.Z_MARK}
        ax.add_patch(FancyBboxPatch([x, y] - half, *(2 * half), **look))
        marks.write_mark(ax, (x, y), name)
    wave = np.linspace(sensor + 0.06 * up + [0.05 * side, 0.03], [x - side * half[0], collection], 90)
    wave[:, 1] += 0.012 * np.sin(np.linspace(0, 30 * pi, 90)) * (np.arange(90) < 84)
    ax.plot(*wave.T, "-", color=BLUE, linewidth=0.8, label="radio")
    marks.arrow(ax, wave[-4], wave[-1], color=BLUE)
    marks.write_mark(ax, wave[45] + [0, 0.06], "radio", color=BLUE)
    marks.arrow(ax, (x, collection - half[1]), (x, computer + half[1]))
    shaft = [[x - side * half[0], motor], [rig.sprocket.x, motor], [rig.sprocket.x, rig.sprocket.y]]
    marks.line(ax, *shaft, linestyle=(0, (8, 2, 1, 2)), linewidth=1.4)
    marks.write_mark(ax, (x, motor - half[1] - 0.12), f"transmission\n{rig.sprocket.transmission_ratio:g} : 1")
    low = pins[:, 1].min() - GROUND
    for name, (wx, wy, _) in zip(wheel_names(rig), wheel_circles(rig, shift, surface=True), strict=True):
        marks.write_mark(ax, (wx, wy + 0.12), words(name), bbox=BOX)
    left, right = sorted((ends[side < 0] - 0.1 * side, x + side * (half[0] + 0.08)))
    ax.set(xlim=(left, right), ylim=(low - 0.08, sensor[1] + 0.5))
    marks.bare(ax)
    return figure


@styled
def piece_figure(rig: Rig) -> Figure:
    """Draw Figure 2: a stretched piece of the chain with its dimensions (a), and with its bushings unloaded (b)."""
    chain, b, half = rig.chain, rig.connector_length, rig.chain.link_thickness / 2
    low, high = -chain.connector_radius, half
    figure = new_figure(4.2)
    stretched, free = figure.subplots(2, 1)
    pins = _draw_piece(stretched, rig, 0.0)
    for first, last, name, length, below in (
        (0, 1, "link", chain.link_length, 0.012), (3, 4, "$L_C$ =", b, 0.012),
        (0, 2, "pitch", chain.link_length + b, 0.042),
    ):  # fmt: skip
        text = f"{name} {marks.millimetres(length)}"
        marks.dimension(stretched, pins[first], pins[last], text, offset=low - below, side=-1)
    edge = pins[5] + [0.02, 0.0]
    marks.dimension(stretched, edge + [0, -half], edge + [0, half], "", turned=False)
    marks.write_mark(stretched, edge + [0.004, 0.0], f"$D$ = {marks.millimetres(2 * half)}", ha="left")
    tip = pins[2] + chain.connector_radius * marks.polar(0.35 * pi)
    marks.arrow(stretched, pins[2], tip)
    name = f"$r_C$ = {marks.millimetres(chain.connector_radius)}"
    marks.leader(stretched, tip, name, (tip[0] - 0.062, high + 0.045))
    link = f"track link\n{chain.link_mass:.3g} kg\n{chain.link_inertia:.3g} kg m²"
    connector = f"connector\n{chain.connector_mass:.3g} kg\n{chain.connector_inertia:.3g} kg m²"
    for point, name, up in (
        (0.5 * (pins[2] + pins[3]) - [0.012, 0.0], link, 0.05),
        (0.5 * (pins[3] + pins[4]) + [0.012, 0.0], connector, 0.05),
        (pins[5] + [0.0, HOLE * half * 0.85], "bushing", 0.045),
        (pins[0] + [0, 0.15 * half], "pin", 0.045),
    ):
        marks.leader(stretched, point, name, (point[0] + 0.003, high + up))
    for body in (2, 3):
        stretched.plot(*(0.5 * (pins[body] + pins[body + 1])), marker="+", color=BLACK, zorder=drawing.Z_MARK)
    stretched.set(ylim=(low - 0.064, high + 0.075), xlim=(-0.02, pins[-1, 0] + 0.125))
    stretched.set_title("(a) stretched piece")
    angle = rig.bushing.free_angle
    phi = ENLARGED * angle
    pins = _draw_piece(free, rig, phi)
    joint, reach = pins[3], 0.095
    for heading, dashes in ((2 * phi, (0, (5, 2))), (3 * phi, "-")):  # link before, connector
        marks.line(free, joint, joint + 1.05 * reach * marks.polar(heading), linestyle=dashes, linewidth=0.8)
    marks.angle(free, joint, reach, 2 * phi, 3 * phi, "")
    text = rf"$\varphi_0$ = {angle:g} rad ({np.degrees(angle):.1f}°), drawn {ENLARGED} times larger"
    point = joint + reach * marks.polar(2.5 * phi)
    marks.leader(free, point, text.replace("-", "\N{MINUS SIGN}"), (0.5 * pins[-1, 0] + 0.1, high + 0.035))
    free.set(xlim=stretched.get_xlim(), ylim=(pins[:, 1].min() - 0.035, high + 0.05))
    free.set_title("(b) the same piece with its bushings unloaded")
    for ax in (stretched, free):
        marks.bare(ax)
    return figure


def _draw_piece(ax: Axes, rig: Rig, joint_angle: float) -> np.ndarray:
    """Draw three links and two connectors, every joint rotated by an angle (rad); return their pins, m."""
    pins, heading, half = [np.zeros(2)], 0.0, rig.chain.link_thickness / 2
    kinds = (
        (drawing.link_outline(rig), drawing.LINK, drawing.Z_LINK, rig.chain.link_length),
        (drawing.connector_outline(rig), drawing.CONNECTOR, drawing.Z_CONNECTOR, rig.connector_length),
    )
    for body in range(5):
        outline, face, z, length = kinds[body % 2]
        look = {"facecolor": face, "edgecolor": drawing.EDGE, "linewidth": 0.8, "zorder": z}
        ax.add_patch(Polygon(drawing.placed(outline, pins[-1], heading), **look, alpha=0.9))
        pins.append(pins[-1] + length * marks.polar(heading))
        heading += joint_angle
    for pin in pins:
        look = {"linewidth": 0.6, "zorder": drawing.Z_LINK + 0.5}
        ax.add_patch(Circle(pin, HOLE * half, facecolor="white", edgecolor=drawing.RUBBER, hatch="xxxx", **look))
        ax.add_patch(Circle(pin, PIN * half, facecolor=drawing.STEEL, edgecolor=drawing.STEEL_EDGE, **look))
    return np.array(pins)


@styled
def topology_figure(rig: Rig) -> Figure:
    """Draw Figure 3: elements of the loop as simulated (a) and as the paper counts them (b)."""
    figure = new_figure(6.0)
    single = build_chain(rig, "single_pin")
    chains = (("(a) links and connectors", build_chain(rig)), ("(b) one body per pitch", single))
    for ax, (title, chain) in zip(figure.subplots(2, 1), chains, strict=True):
        bodies = len(chain.length)
        links = np.isclose(chain.length, rig.chain.link_length)
        kinds = ["pitch"] * bodies if bodies == rig.chain.pitches else np.where(links, "link", "connector").tolist()
        _draw_loop(ax, kinds)
        ax.set_title(f"{title}: {bodies} bodies, {bodies - 1} joints in the tree, joint {2 * bodies} cut")
    return figure


def _draw_loop(ax: Axes, kinds: list[str]) -> None:
    """Draw bodies as circles and squares, joints as arrows in the transfer direction, the cut joint crossed out."""
    straight, r, count = 3.4, 1.5, 2 * len(kinds)
    path = belt_path([[-straight / 2, 0.0, r], [straight / 2, 0.0, r]])  # which begins where it meets the left circle
    places = path.along(np.arange(count) * path.length / count - straight / 2)[0]
    spacing = np.hypot(*(places[2] - places[0]))
    half = 0.34 * spacing
    square = 0.9 * half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for number, kind in zip(range(1, count, 2), kinds, strict=True):
        body, joint, outboard = places[number - 1], places[number], places[(number + 1) % count]
        look = {"facecolor": KINDS[kind][0], "edgecolor": drawing.EDGE, "linewidth": 0.7, "zorder": drawing.Z_MARK}
        ax.add_patch(Polygon(body + square, **look) if kind == "connector" else Circle(body, half, **look))
        if spacing > 0.3:
            ax.text(*body, str(number), ha="center", va="center", fontsize=SMALL, zorder=drawing.Z_MARK + 2)
        elif number % EVERY == 1:
            outward = marks.directions(places[number - 2], joint)[1]
            marks.write_mark(ax, body + 0.28 * outward, str(number), fontsize=SMALL)
        step, left = marks.directions(body, outboard)
        marks.arrow(ax, body + half * step, outboard - half * step, linewidth=0.8, mutation_scale=6)
    ends = [joint + 0.45 * spacing * left, joint - 0.45 * spacing * left]
    marks.line(ax, *ends, color=VERMILION, linewidth=2.2, zorder=drawing.Z_MARK + 1)
    marks.leader(ax, ends[1], f"joint {count}, cut", joint - 0.42 * left)
    handles = []
    for kind in dict.fromkeys(kinds):
        face, words = KINDS[kind]
        look = {"marker": "s" if kind == "connector" else "o", "markersize": 8, "markerfacecolor": face}
        handles.append(marks.handle(words, linestyle="none", markeredgecolor=drawing.EDGE, **look))
    look = {"color": BLACK, "marker": ">", "markersize": 4, "linewidth": 0.8}
    handles.append(marks.handle("revolute joint (even number), transfer direction", **look))
    ax.legend(handles=handles, loc="center")
    drawing.view(ax, (0.0, 0.0), (straight / 2 + r + 0.45, r + 0.5))
    marks.bare(ax)
