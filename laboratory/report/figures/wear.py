"""Lives of worn rigs: what changes over the kilometres and over the fraction of the life."""

from trackdyn.sweeps.job import run_job

from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.report.wear import LIFE, wear_text
from trackdyn.files import write_csv
from trackdyn.plots.style import BLUE, ORANGE, SMALL, new_figure, save, styled

DOWN = (
    ("ring radius (mm)", ("ring_radius_m",), 1e3),
    ("contact\n(% of a turn)", ("left_share_pct", "right_share_pct"), 1.0),
    ("peak force (kN)", ("left_peak_n", "right_peak_n"), 1e-3), ("RMS (g)", ("rms_g",), 1.0),
    ("dominant\npeak (g)", ("line_g",), 1.0),
)  # fmt: skip
STYLES = ("-", "--", ":", "-.")


@styled
def life_figure(lives, name: str, radius: float = 0.308):
    """Radius, shares, peaks and accelerations of the lives of the rig of this name with this first radius (m)."""
    figure = new_figure(7.0)
    axes = figure.subplots(len(DOWN), 2, sharex="col", sharey="row")
    chosen = lives[(lives["rig"] == name) & np.isclose(lives["first_radius_m"], radius)]
    for style, ((rpm, tension), table) in zip(STYLES, chosen.groupby(["rpm", "tension"], sort=False), strict=False):
        run = table["distance_km"].to_numpy()
        for row, (label, names, scale) in enumerate(DOWN):
            for axis, across in zip(axes[row], (run / 1e3, 100 * run / (run[-1] or 1.0)), strict=True):
                for colour, column in zip((BLUE, ORANGE), names, strict=False):
                    axis.plot(across, scale * table[column], style, color=colour, marker=".", ms=3)
            axes[row][0].set_ylabel(label)
        axes[0][0].plot([], [], style, color=BLUE, label=f"{rpm:g} rpm, {tension}")
    for side, colour in (("left", BLUE), ("right", ORANGE)):
        axes[1][0].plot([], [], "-", color=colour, label=f"{side} arc")
    for panel in axes[:2, 0]:
        panel.legend(fontsize=SMALL)
    for panel, words in zip(axes[-1], ("distance (1000 km)", "fraction of the life (%)"), strict=True):
        panel.set_xlabel(words)
    figure.suptitle(f"rig {name}, first radius {radius:g} m", fontsize=8)
    return figure


def main(job) -> None:
    """Rule `wear_form`."""
    tables = []
    for path in job.input.lives:
        rig, rpm, tension, radius = Path(path).stem.rsplit("_", 3)
        life = dict(zip(LIFE, (rig, float(rpm), tension, float(radius)), strict=True))
        tables.append(pd.read_parquet(path).drop(columns="depths").assign(**life))
    lives = pd.concat(tables, ignore_index=True)
    write_csv(job.output.csv, lives, float_format="%.7g")
    # friction of the others wears no real ring
    save(life_figure(lives, "parts"), job.output.figures[0])
    print(wear_text(lives))


if __name__ == "__main__":
    run_job(main)
