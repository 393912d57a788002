"""Curves and moving pictures in the form in which the page carries them: short numbers, which compress well."""

from pathlib import Path

import numpy as np
import pandas as pd

from replication.paper import printed
from replication.report.figures.meshing import AFTER, BEFORE, printed_times, select_passage
from trackdyn.measure.columns import MEASURES, error_of, words
from trackdyn.measure.sensor import own_loop_hz, sense
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig
from trackdyn.plots.cells import with_error
from trackdyn.plots.drawing import FORCE_BAR, FORCE_MOST, radius_words
from trackdyn.plots.histories import REVOLUTIONS, first_crest
from trackdyn.plots.rendering import CONFIGURATION, differences, short
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.sensor.signals import LOW_RANGE_HZ, in_bands, main_line, main_line_binfree, spectrum
from trackdyn.simulation.recording import Recording

RING_COLUMNS = [
    f"{side}_{what}" for what in ("share_pct", "rms_n", "sd_n", "phase_start") for side in ("left", "right", "ring")
]


def _signal(ay, rate: float, hz: float, span: float) -> dict:
    ay = np.asarray(ay)
    start = first_crest(ay, rate, hz)
    freq, amplitude = (part[1:] for part in spectrum(ay, rate))
    low = freq <= LOW_RANGE_HZ
    band_hz, band_g = in_bands(freq, amplitude)
    line, free = main_line(ay, rate, hz), main_line_binfree(ay, rate, expected_hz=hz)[:2]
    return {
        "rate": rate, "history": short(ay[start : start + round(span * rate) + 1]), "low_hz": short(freq[low]),
        "low_g": short(amplitude[low]), "band_hz": short(band_hz), "band_g": short(band_g),
        "line": [float(line[0]), float(line[1])], "free": [float(free[0]), float(free[1])],
    }  # fmt: skip


def signals(recording: Recording, record: SensorRecord | None) -> dict:
    """Time histories over two revolutions and spectra of a run, and of a sensor's record of that speed.

    ``simulation`` and ``sensor`` are cut and aligned as in Figure 17 and analysed as in Figure 18.
    """
    hz = recording.periods.loop_hz
    span = REVOLUTIONS / hz
    shown = {"simulation": _signal(sense(recording).ay, recording.rate, hz, span), "sensor": None, "printed": None}
    rpm = recording.scene.motor_rpm
    if rpm in printed.SIMULATED_LINE_HZ.value:
        shown["printed"] = [printed.SIMULATED_LINE_HZ.value[rpm], printed.SIMULATED_LINE_G.value[rpm]]
    if record is not None:
        shown["sensor"] = _signal(record.ay_g, record.rate_hz, own_loop_hz(record.ay_g, record.rate_hz, hz), span)
    return shown


def passage_data(recording: Recording) -> dict:
    """Forces and areas of the passage that Figures 19 and 21 show."""
    shown = select_passage(recording)
    margin = np.array([-BEFORE, AFTER]) * shown.turn
    inside = (shown.time >= margin[0]) & (shown.time <= shown.last - shown.first + margin[1])
    return {
        "connector": shown.connector,
        "rpm": recording.scene.motor_rpm,
        "radius": recording.scene.ring_radius,
        "ring": radius_words(recording.scene.ring_radius),
        "time": short(shown.time[inside], 6),
        "force": [short(column) for column in shown.force[inside].T],
        "area": shown.area[inside].T.tolist(),
        "printed": printed_times(recording.scene.ring_radius is not None, shown.turn),
    }


def ring_study(metrics: pd.DataFrame) -> dict | None:
    """Shares, forces and phases of the ring study by radius and speed, with their errors; None without such a run."""
    study = metrics[metrics["run"].astype(str).str.startswith("ring/")]
    if study.empty:
        return None
    none = [None] if study["ring_radius_m"].isna().any() else []
    radii = none + [float(r) for r in sorted(study["ring_radius_m"].dropna().unique())]
    speeds = [float(s) for s in sorted(study["rpm"].unique())]
    shown, nothing = [column for column in RING_COLUMNS if column in study], [[None] * len(radii)] * len(speeds)
    cells = {
        column: [[None] * len(radii) for _ in speeds]
        for name in shown
        for column in (name, error_of(name))
        if column in study
    }
    for _, row in study.iterrows():
        radius = None if pd.isna(row["ring_radius_m"]) else float(row["ring_radius_m"])
        i, j = speeds.index(float(row["rpm"])), radii.index(radius)
        for column, table in cells.items():
            table[i][j] = None if pd.isna(row[column]) else float(row[column])
    values, errors = ({name: cells.get(of(name)) for name in shown} for of in (str, error_of))
    return {
        "speeds": speeds,
        "radii": radii,
        "rings": [radius_words(radius) for radius in radii],
        "values": values,
        "errors": errors,
        "texts": {
            name: [list(map(with_error, *pair)) for pair in zip(values[name], errors[name] or nothing, strict=True)]
            for name in shown
        },
    }


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


def trade(rows: list[dict] | None) -> list[dict] | None:
    """Rows of the study of accuracy against cost in words; a setting that failed has no error."""
    return rows and [
        {
            "group": f"{row['scene']}: {MEASURES[row['measure']][0]}",
            "unit": MEASURES[row["measure"]][1],
            "setting": f"{words(row['fidelity'])}, {words(row['integrator'])}",
            "step": row["step_s"],
            "cpu": row["cpu_s_per_s"],
            "noise": row.get("uncertainty"),
            "error": None if row["failed"] or row["error"] is None else abs(row["error"]),
        }
        for row in rows
    ]
