"""Rows of ring studies on which the rule is tried; ``python -m tests.sweeps.ring_trials FOLDER`` makes them anew."""

import sys
from math import ceil
from pathlib import Path

import pandas as pd

from trackdyn.measure.ring_rule import ARCS, COMPARED
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.rings import study_radii
from trackdyn.scene.scene import Scene
from trackdyn.sweeps.ring import ring_study

STORED = Path(__file__).parents[2] / "docs" / "measured" / "ring_trials.csv"
HERE = Path(__file__).parent
BEYOND = 1e-3  # m
TRACKS = {  # rig, speeds (rev/min), time steps (s)
    "paper": ("paper", (115.0, 210.0), ()),
    "bench": ("bench", (115.0, 210.0), ()),
    "worn bench": (HERE / "worn_bench.yaml", (115.0, 210.0), ()),
    "m113": ("m113", (90.0, 150.0), ()),
    "marder": (HERE / "marder.yaml", (60.0, 120.0), (5e-5,)),
}


def radii_of(rig: Rig) -> dict[float, str]:
    """Radii (m) of the trials by grid: ``default``, ``halved`` between those, a millimetre ``beyond`` both ends."""
    default, (low, high) = study_radii(rig), Scene.ring_range(rig)
    half, more = (default[-1] - default[0]) / 20, ceil(20 * BEYOND / (default[-1] - default[0]))
    grid = {default[0] + half * k: ("default", "halved")[k % 2] for k in range(21)}
    grid |= {default[0] + half * k: "beyond" for k in (*range(-more, 0), *range(21, 21 + more))}
    return {round(radius, 5): name for radius, name in grid.items() if low <= radius <= high}


def rows_of(name: str, store: Path) -> pd.DataFrame:
    """Run the study of a track and keep the columns of rule and page."""
    path, speeds, steps = TRACKS[name]
    grid, rig = radii_of(load_rig(path)), load_rig(path)
    rows = ring_study(rig, speeds, list(grid), 1, store / name.replace(" ", "_"), step=steps)
    if not (rows["state"] == "done").all():
        raise SystemExit(f"{name}: {rows['reason'].dropna().iloc[0]}")
    rows = rows.assign(track=name, teeth=rig.sprocket.teeth, grid=rows["ring_radius_m"].map(grid).fillna("no ring"))
    measures = [f"{arc}_{name}" for arc in ARCS for name in ("share_pct", "peak_n", "peak_error_n")]
    return rows[["track", "teeth", "rpm", "ring_radius_m", "grid", *measures, *COMPARED]]


if __name__ == "__main__":
    pd.concat([rows_of(name, Path(sys.argv[1])) for name in TRACKS]).to_csv(STORED, index=False, float_format="%.5g")
