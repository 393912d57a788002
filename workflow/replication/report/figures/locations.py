"""Figure 4: the surfaces of chain and wheels that touch."""

from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from replication.report import marks
from replication.report.figures.engagement import seated_pins
from replication.report.figures.system import touching_links
from trackdyn.measure.columns import words
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, VERMILION, new_figure, styled
from trackdyn.rig.layout import wheel_circles, wheel_names
from trackdyn.rig.rig import Rig

ON_CHAIN = {"color": BLUE, "linestyle": "-", "linewidth": 2.4}
ON_WHEEL = {"color": VERMILION, "linestyle": (0, (3, 1)), "linewidth": 2.4}


@styled
def locations_figure(rig: Rig) -> Figure:
    """Figure 4: surfaces that touch: connector and groove (a), link and ring (b), and the next two wheels (c, d)."""
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
    """A connector at rest in its groove, both arcs and the ten areas emphasized."""
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
    """A link in the middle of those on a wheel, turned so that it lies on top."""
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
    for bodies in ax.collections:  # connectors stand beside ring and tyres: here behind them
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
