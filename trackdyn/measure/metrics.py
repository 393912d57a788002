"""One row of numbers a run: the columns of ``metrics.csv``. A new metric is added here; no simulation depends on it."""

import numpy as np

from trackdyn.measure.columns import table_schema
from trackdyn.measure.contacts import LONGEST_CONTACT, PASSAGE, meshing_summary
from trackdyn.measure.sensor import sense, sensor_metrics, specific_force
from trackdyn.measure.spectra import LEAST_PERIODS, rms
from trackdyn.measure.uncertainty import NAN, whole_errors
from trackdyn.measure.whole_loop import sliding_work
from trackdyn.scene.choices import label
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording

SHOWN = (
    "rms_g", "sd_g", "line_hz_binfree", "line_g_binfree", "high_frequency_g", "left_share_pct", "right_share_pct",
    "ring_share_pct", "left_peak_n", "right_peak_n", "ring_peak_n", "teeth_sliding_j", "ring_sliding_j", "passages",
    "clipped_samples", "loop_gap_max_m", "energy_residual",
)  # fmt: skip
OF_THE_EARTH = 0.005  # share by which gravity differs between poles and equator
SAME_SPEED = 0.01  # of a speed: from here on a difference or a drift is said


def run_metrics(name: str, recording: Recording) -> dict:
    """The row of a run: what ran, what the sensor and the contacts show."""
    scene, signal = recording.scene, sense(recording)
    speeds, gaps = recording.speeds, recording.cut.max(axis=0) if len(recording.cut) else (NAN, NAN)
    return {
        "run": name,
        "rpm": scene.motor_rpm,
        "rpm_made": recording.made_rpm,
        "rpm_drift_pct": 100 * float(np.ptp(speeds)) / recording.made_rpm if recording.made_rpm else 0.0,
        "ring_radius_m": NAN if scene.ring_radius is None else scene.ring_radius,
        "fidelity": label(recording.meta["fidelity"]),
        "step_s": scene.time_step,
        "simulated_s": recording.seconds,
        **sensor_metrics(signal.ay, recording.rate, recording.periods.loop_hz),
        "loop_gap_max_m": float(recording.gap.max()),
        "gap_before_projection_m": float(gaps[0]),
        "velocity_gap_m_s": float(gaps[1]),
        "energy_residual": energy_residual(recording),
        "resolved": recording.meta.get("resolved", {}).get("state", "not judged"),
        "clipped_samples": signal.clipped,
        "settled_tension_n": recording.meta["layout"].get("settled_tension_n", NAN),
        **meshing_summary(recording),
        **sliding_work(recording),
    }


def shown_measures(recording: Recording) -> list[dict]:
    """What a person asks of a run: ``name``, ``measure``, ``value``, ``error`` of scatter and step or None, ``unit``.

    What the run cannot have is left out.
    """
    rows, row, whole = [], run_metrics("", recording), whole_errors(recording.scene)
    for field in table_schema(SHOWN)["fields"]:
        value, error = row[field["name"]], row.get(field.get("standardError"), NAN)
        if value == value:
            unit = "" if field["unit"] == "1" else field["unit"]
            error = whole(field["name"], value, error)
            error = None if error != error else error
            rows.append(
                {"name": field["name"], "measure": field["description"], "value": value, "error": error, "unit": unit}
            )
    return rows


def needed_lengths(recording: Recording) -> dict[str, float]:
    """What the recording is too short for, with the record (s) that holds it wherever it begins."""
    periods = recording.periods
    needed = {"dominant peak and standard errors": LEAST_PERIODS * periods.loop}
    if recording.scene.contact_log:
        passage = periods.loop + (2 * LONGEST_CONTACT + PASSAGE) * periods.turn
        needed["contacts of the recorded pitches"] = passage
    return {what: seconds for what, seconds in needed.items() if recording.seconds < seconds}


def remarks(recording: Recording) -> list[str]:
    """Sentences that belong to the numbers of a run: on its speed, the range of the sensor and the unit g."""
    return [text for of in (speed_sentence, range_sentence, gravity_sentence) if (text := of(recording))]


def range_sentence(recording: Recording) -> str:
    """Sentence on accelerations beyond the sensor's range, of every link where they are recorded; empty without any."""
    rig = recording.scene.rig
    mean, limit = recording.link_mean if recording.link_mean.size else recording.mean, rig.sensor.range
    ay = specific_force(mean[..., :2], mean[..., 2], rig.gravity)[..., 1] / (rig.gravity or 9.81)
    if not (beyond := int((abs(ay) > limit).sum())):
        return ""
    limited, free = rms(np.clip(ay, -limit, limit).ravel()), rms(ay.ravel())
    return (
        f"{beyond} of {ay.size} samples of the y acceleration are beyond the sensor's range of {limit:g} g and limited "
        f"to it: RMS is {limited:.4g} g with this sensor and {free:.4g} g without a limit (sensor.range of the rig)"
    )


def gravity_sentence(recording: Recording) -> str:
    """Sentence on the unit g of a rig that is not on the earth; empty for the others."""
    gravity = recording.scene.rig.gravity
    if not gravity or abs(gravity / 9.81 - 1) < OF_THE_EARTH:
        return ""
    return f"1 g is the rig's gravity of {gravity:g} m/s2; a sensor shows multiples of 9.81 m/s2"


def speed_sentence(recording: Recording) -> str:
    """Sentence on a speed that is not the one asked for or not steady, to a percent; empty where it is."""
    asked, made, speeds = recording.scene.motor_rpm, recording.made_rpm, recording.speeds
    drifts = np.ptp(speeds) > SAME_SPEED * made
    if not drifts and abs(made - asked) <= SAME_SPEED * asked:
        return ""
    drift = f", from {speeds[0]:.4g} to {speeds[-1]:.4g} within the record" if drifts else ""
    return (
        f"the motor speed was {made:.4g} of {asked:.4g} rev/min{drift}; shares, phases and passages are those of the "
        "turns that the sprocket made"
    )
