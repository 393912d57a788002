"""What moves when a fitted parameter moves."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from trackdyn.measure.columns import heading
from trackdyn.plots.drawing import radius_words
from trackdyn.plots.style import new_figure, styled

# changes beyond this many tolerances share the last shade
LIMIT = 3.0
PARAMETERS = {
    "sprocket.equal_pitch_radius": "equal-pitch radius (m)",
    "groove.seat_depth": "depth of the seats (m)",
    "groove.slope_seat": "slope of the seats (°)",
    "groove.r2": "radius of areas 2, 9 (m)",
    "tension.pre_tension": "pre-tension (N)",
    "idler.bearing_drag": "wheels: bearing drag (N m s/rad)",
    "idler.rolling_arm": "wheels: rolling arm (m)",
    "idler.seal_drag": "wheels: drag of seals (N m s/rad)",
    "bushing.stiffness": "bushings: stiffness (N m/rad)",
    "bushing.damping": "bushings: damping (N m s/rad)",
    "bushing.loss_factor": "bushings: loss factor",
    "ring_contact.youngs_modulus": "ring: modulus (Pa)",
    "ring_contact.transition_velocity": "ring: transition velocity (m/s)",
    "wheel_contact.transition_velocity": "wheels: transition velocity (m/s)",
}


def parameter_words(path: str) -> str:
    """A parameter of the rig in words, with its unit if it is known here."""
    return PARAMETERS.get(path, path.replace(".", ": ").replace("_", " "))


def measure_words(name: str) -> str:
    """A measure of the runs, such as ``left_share_pct``, in words; forces without a unit.

    They may be targets as such or as ratios to those of another radius, which the table does not tell.
    """
    return heading(name).removesuffix(" (N)")


def change_text(value: float) -> str:
    """A change to one place; a plain 0 for what rounds to it, a dash for none."""
    if not np.isfinite(value):
        return "\N{EN DASH}"
    text = f"{value:.1f}"
    return "0" if float(text) == 0 else text.replace("-", "\N{MINUS SIGN}")


def sensitivity_matrix(table: pd.DataFrame) -> pd.DataFrame:
    """Changes in tolerances, a row a measure and a column a parameter, in words; a table of ``fit.sensitivity``."""
    where = table["ring_radius_m"].map(radius_words)
    table = table.assign(name=table["claim"] + " " + table["measure"].map(measure_words) + ", " + where)
    cells = table.drop_duplicates(["parameter", "name"])
    grid = cells.pivot(index="name", columns="parameter", values="change_in_tolerances")
    return grid.loc[table["name"].unique(), table["parameter"].unique()].rename(columns=parameter_words)


@styled
def sensitivity_figure(table: pd.DataFrame) -> Figure:
    """Change of each measure, in tolerances of its target, if one parameter changes; a table of ``fit.sensitivity``."""
    grid = sensitivity_matrix(table)
    values = grid.to_numpy(dtype=float)
    figure = new_figure(0.3 * len(grid) + 2.6)
    ax = figure.subplots()
    ax.imshow(values, cmap="PuOr", vmin=-LIMIT, vmax=LIMIT, aspect="auto")
    for i, j in np.ndindex(values.shape):
        dark = np.isfinite(values[i, j]) and abs(values[i, j]) > 0.75 * LIMIT
        text = change_text(values[i, j])
        colour = "white" if dark else "0.55" if text == "0" else "black"
        ax.text(j, i, text, ha="center", va="center", fontsize=7, color=colour)
    look = {"rotation": 50, "rotation_mode": "anchor", "ha": "right"}
    ax.set_xticks(range(grid.shape[1]), grid.columns, **look)
    ax.set_yticks(range(grid.shape[0]), grid.index)
    ax.tick_params(length=2)
    ax.grid(False)
    title = "Change of a measure in tolerances of its target, one parameter changed\n(shades: brown falls, purple rises"
    beyond = f"; one for all beyond {LIMIT:g})" if (np.abs(values) > LIMIT).any() else ")"
    figure.suptitle(title + beyond, x=0.01, ha="left")
    return figure
