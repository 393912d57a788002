"""A rig as it stands: sprocket, wheels, what they stand on, and the chain around them."""

import numpy as np
from matplotlib.figure import Figure

from trackdyn.parameters.layout import wheel_names
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.wheels import Arm
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, SMALL, VERMILION, new_figure, styled


@styled
def draw_rig(rig: Rig, frame, wheels) -> Figure:
    """The loop in a configuration (a row of ``Recording.frame``) with its wheels, (w, 3) centres and radii, m."""
    pins, _, angle = drawing.chain_points(rig, frame)
    middle, half = (pins.max(axis=0) + pins.min(axis=0)) / 2, np.ptp(pins, axis=0) / 2
    margin = 0.06 * half.max() + rig.chain.link_thickness
    half = half + margin
    height = min(max(6.4 * half[1] / half[0], 1.6), 6.4) + 0.7
    figure = new_figure(height, 7.2)
    ax = figure.add_subplot()
    drawing.draw_discs(ax, wheels[1:])
    drawing.draw_sprocket(ax, rig, angle, rig.ring_radius)
    drawing.draw_chain(ax, rig, frame)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    label = {"ha": "center", "va": "center", "fontsize": SMALL, "color": BLACK, "bbox": box}
    label["zorder"] = drawing.Z_MARK + 1
    for name, (x, y, radius) in zip(wheel_names(rig), wheels, strict=True):
        carrier = None if name == "sprocket" else rig.rollers[name].carrier
        if isinstance(carrier, Arm):
            look = {"color": BLUE, "zorder": drawing.Z_MARK}
            ends = [carrier.x, x], [carrier.y, y]
            ax.plot(*ends, linestyle="-", linewidth=2.0, solid_capstyle="round", **look)
            ax.plot([carrier.x], [carrier.y], marker="o", markersize=4, **look)
        if name == rig.tension.wheel or (carrier is not None and not isinstance(carrier, Arm)):
            turn = np.radians(rig.tension.direction if name == rig.tension.wheel else carrier.direction)
            along = 0.35 * radius * np.array([np.cos(turn), np.sin(turn)])
            ax.annotate("", (x + along[0], y + along[1]), (x - along[0], y - along[1]), zorder=drawing.Z_MARK,
                        arrowprops={"arrowstyle": "<->", "color": VERMILION, "linewidth": 1.4})  # fmt: skip
        words = name.replace("_", " ") + (", tensioner" if name == rig.tension.wheel else "")
        ax.text(x, y - 0.5 * radius, words, **label)
    drawing.view(ax, middle, half)
    ax.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    return figure
