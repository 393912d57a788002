"""Lives of worn rigs: what changes, the profile of a groove, and the first radius that lasts longest."""

import numpy as np

from laboratory.wear.contour import contours
from laboratory.wear.study import OF_A_LIFE, PROFILES
from trackdyn.parameters.rig import Rig
from trackdyn.plots.style import BLUE, ORANGE, SMALL, VERMILION, new_figure, styled

ACROSS = (("distance_km", 1e-3, "distance (1000 km)"), ("life", 100.0, "fraction of the life (%)"))
DOWN = (
    ("ring radius (mm)", ("ring_radius_m",), 1e3),
    ("contact\n(% of a turn)", ("left_share_pct", "right_share_pct"), 1.0),
    ("peak force (kN)", ("left_peak_n", "right_peak_n"), 1e-3), ("RMS (g)", ("rms_g",), 1.0),
    ("dominant\npeak (g)", ("line_g",), 1.0),
)  # fmt: skip
SEEN = 5e-3  # deepest wear in the drawing of a profile, to a power of ten (m)
STYLES = ("-", "--", ":", "-.")


@styled
def life_figure(lives, name: str, radius: float = 0.308):
    """Radius, shares, peaks and what the sensor feels over the kilometres and over the share of the life.

    Those lives (`laboratory.wear.study.run_lives`) of the rig of this name are drawn that have this first radius (m).
    """
    figure = new_figure(7.0)
    axes = figure.subplots(len(DOWN), 2, sharex="col", sharey="row")
    chosen = lives[(lives["rig"] == name) & np.isclose(lives["first_radius_m"], radius)]
    for style, (life, table) in zip(STYLES, chosen.groupby(OF_A_LIFE, sort=False), strict=False):
        for row, (label, names, scale) in enumerate(DOWN):
            for column, (across, by, words) in enumerate(ACROSS):
                for colour, drawn in zip((BLUE, ORANGE), names, strict=False):
                    axes[row][column].plot(
                        by * table[across], scale * table[drawn], style, color=colour, marker=".", ms=3
                    )
                axes[-1][column].set_xlabel(words)
            axes[row][0].set_ylabel(label)
        axes[0][0].plot([], [], style, color=BLUE, label=f"{life[1]:g} rpm, {life[2]}")
    axes[1][0].plot([], [], "-", color=BLUE, label="left arc")
    axes[1][0].plot([], [], "-", color=ORANGE, label="right arc")
    for panel in axes[:2, 0]:
        panel.legend(fontsize=SMALL)
    figure.suptitle(f"rig {name}, first radius {radius:g} m", fontsize=8)
    return figure


@styled
def profile_figure(rig: Rig, lives, flanks: dict, name: str, radius: float = 0.308):
    """Groove at 0, 25, 50, 75 and 100 % of a life, depths enlarged; depths over the contour below.

    It is the first life of the rig of this name with this first radius (m); ``flanks`` are depths by life.
    """
    figure = new_figure(4.0)
    shape, over = figure.subplots(2, 1, height_ratios=[1, 2])
    life = next((one for one in flanks if one[0] == name and np.isclose(one[3], radius)), None)
    if life is None:
        shape.set_title(f"no life of the rig {name}")
        return figure
    end = lives[(lives[OF_A_LIFE] == list(life)).all(axis=1)]["distance_km"].iloc[-1]
    deepest = max(np.max(depth) for depths in flanks[life] for depth in depths)
    enlarged = 10.0 ** max(0, round(np.log10(SEEN / deepest))) if deepest > 0 else 1.0
    for k, (share, depths) in enumerate(zip(PROFILES, flanks[life], strict=True)):
        colour = str(0.7 * (1 - share))
        for side, contour, depth in zip((1.0, -1.0), contours(rig.groove_profile), map(np.array, depths), strict=True):
            worn = contour.worn(enlarged * depth)
            along = np.cumsum(contour.length) - contour.length.sum()
            label = f"{share:.0%}, {share * end:.0f} km" if side > 0 else None
            shape.plot(1e3 * side * worn[:, 0], 1e3 * worn[:, 1], "-", color=colour, lw=0.6 + 0.2 * k)
            over.plot(1e3 * side * along, 1e3 * depth, "-", color=colour, lw=0.6 + 0.2 * k, label=label)
    shape.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)", title=f"groove, wear enlarged {enlarged:g} times")
    over.legend(fontsize=SMALL)
    over.set(xlabel="along the contour from the bottom: left flank, right flank (mm)", ylabel="depth (mm)")
    figure.suptitle(f"rig {name}, {life[1]:g} rpm, {life[2]}, first radius {life[3]:g} m", fontsize=8)
    return figure


@styled
def radius_figure(seen):
    """Run in the good window by the first radius of the ring, and how many rigs are in it; the printed one is marked.

    Of a rig, speed and tension it is the life with the largest first radius (`laboratory.wear.study.windows`).
    """
    figure = new_figure(3.2)
    run, share = figure.subplots(1, 2, sharex=True)
    longest = seen[seen.groupby(OF_A_LIFE[:3])["first_radius_m"].transform("max") == seen["first_radius_m"]]
    colours = {}
    for (rig, rpm, tension), table in longest.groupby(OF_A_LIFE[:3], sort=False):
        radius, part = 1e3 * table["radius_m"], 100 * table["good_km"] / (table["good_km"].max() or 1.0)
        if rig.startswith("drawn"):
            run.plot(radius, part, "-", color="0.8", lw=0.8, zorder=0)
        else:
            colour = colours.setdefault(rig, (BLUE, VERMILION, ORANGE)[len(colours) % 3])
            style = STYLES[2 * (rpm > 150) + (tension != "locked")]
            run.plot(radius, part, style, color=colour, label=f"{rig}, {rpm:g} rpm, {tension}")
    for kind, mark, colour in ((True, "drawn rigs", "0.5"), (False, "rigs with a name", BLUE)):
        chosen = longest[longest["rig"].str.startswith("drawn") == kind]
        good = 100 * chosen.groupby("radius_m")["good"].mean()
        share.plot(1e3 * good.index, good, "-", color=colour, label=mark)
    share.legend(fontsize=SMALL)
    run.set_ylabel("run in the good window\n(% of the longest)")
    share.set_ylabel("in the good window\n(% of the lives)")
    for panel in (run, share):
        panel.axvline(308, color="0.3", lw=0.8, zorder=0)
        panel.set(xlabel="radius of the ring (mm)", ylim=(0, None))
    figure.legend(*run.get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=SMALL)
    return figure
