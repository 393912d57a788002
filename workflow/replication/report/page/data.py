"""The ring study and moving pictures in the form in which the page carries them: short numbers, which compress well."""

from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.measure.columns import MEASURES, error_of
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig
from trackdyn.plots.cells import with_error
from trackdyn.plots.drawing import FORCE_BAR, FORCE_MOST, radius_words
from trackdyn.plots.rendering import CONFIGURATION, differences
from trackdyn.simulation.recording import Recording

RING_COLUMNS = [f"{side}_{what}" for what in ("share_pct", "rms_n") for side in ("left", "right", "ring")] + [
    "left_phase_start"
]


def ring_study(metrics: pd.DataFrame) -> dict | None:
    """Shares, forces and phases of the ring study with their errors, a text each; None without such a run."""
    study = metrics[metrics["run"].astype(str).str.startswith("ring/")]
    if study.empty:
        return None
    none = [None] if study["ring_radius_m"].isna().any() else []
    radii = none + [float(r) for r in sorted(study["ring_radius_m"].dropna().unique())]
    speeds = [float(s) for s in sorted(study["rpm"].unique())]
    texts = {name: [[""] * len(radii) for _ in speeds] for name in RING_COLUMNS if name in study}
    for row in study.to_dict("records"):
        radius = None if pd.isna(row["ring_radius_m"]) else row["ring_radius_m"]
        i, j = speeds.index(row["rpm"]), radii.index(radius)
        for name, table in texts.items():
            value, error = (None if pd.isna(x) else x for x in (row[name], row.get(error_of(name), None)))
            table[i][j] = with_error(value, error)
    return {"speeds": speeds, "radii": radii, "rings": [radius_words(radius) for radius in radii], "texts": texts}


def rig_geometry(rig: Rig) -> dict:
    """Lengths and outlines that the moving picture is drawn from, m."""
    groove = rig.groove_profile
    return {
        "link": rig.chain.link_length, "connector": rig.connector_length, "thickness": rig.chain.link_thickness,
        "arc": rig.chain.connector_radius, "teeth": rig.sprocket.teeth,
        "sensor": [rig.sensor.pitch, rig.sensor.x, rig.sensor.y], "sprocket": [rig.sprocket.x, rig.sprocket.y],
        "addendum": groove.addendum, "areas": [groove.arc(area, 8).tolist() for area in range(1, 11)],
        "centre": groove.centre.tolist(), "radius": groove.radius.tolist(), "convex": [int(c) for c in groove.convex],
        "force_bar": FORCE_BAR, "force_most": FORCE_MOST * FORCE_BAR,
    }  # fmt: skip


def moving_picture(recording: Recording) -> dict:
    """Configurations of a run with the normal forces and areas of all pitches at these instants."""
    rig = recording.scene.rig
    scene = recording.scene
    # a configuration is taken at the end of a sample interval, and so is the sample
    samples = np.clip(np.rint(recording.frame_time * recording.rate).astype(int) - 1, 0, len(recording.time) - 1)
    shift = recording.meta["layout"]["tensioner_shift_m"]
    return {
        "rpm": scene.motor_rpm, "radius": scene.ring_radius, "ring": radius_words(scene.ring_radius),
        "frames": len(recording.frame), "interval": scene.frame_interval, "bodies": recording.frame.shape[1] - 3,
        "wheels": wheel_circles(rig, shift, surface=True)[1:].tolist(), "unit": CONFIGURATION,
        **differences(recording.frame), "force": np.rint(recording.force[samples]).astype(int).ravel().tolist(),
        "area": recording.area[samples].astype(int).ravel().tolist(),
        "groove": recording.groove[samples].astype(int).ravel().tolist(),
    }  # fmt: skip


def csv_rows(path: Path) -> list[dict] | None:
    """Rows of a CSV file with None for empty cells; None if the file does not exist."""
    if not path.is_file():
        return None
    table = pd.read_csv(path)
    return table.astype(object).where(table.notna(), None).to_dict("records")


def promises(rows: list[dict] | None) -> list[dict] | None:
    """Rows of the planner's promises in words."""
    return rows and [row | {"measure": "{} ({})".format(*MEASURES[row["measure"]])} for row in rows]
