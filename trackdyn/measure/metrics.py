"""One row of numbers a run: the columns of ``metrics.csv``. A new metric is added here; no simulation depends on it."""

import numpy as np
import pandas as pd

from trackdyn.measure.contact_log import LONGEST_CONTACT, PASSAGE, timing
from trackdyn.measure.meshing import first_areas, meshing_summary
from trackdyn.measure.sensor import LEAST_LOOPS, loop_frequency, sense
from trackdyn.measure.sensor_metrics import sensor_metrics
from trackdyn.scene.fidelity import label
from trackdyn.sensor.signals import main_line
from trackdyn.simulation.account import energy_residual
from trackdyn.simulation.recording import Recording

NAN = float("nan")
STARTS = 16  # of a record in a turn of the loop


def lines_by_start(recording: Recording, starts: int = STARTS) -> pd.DataFrame:
    """Dominant peak of the FFT, had the record begun elsewhere in a turn of the loop.

    What a later start needs beyond the end of the record is taken one turn earlier: in steady running every turn is
    like the one before. Windows of a longer run show the same amplitudes to 5e-6 g (115 rpm, 90 s). A table with
    ``start_s`` after the record's own start, ``line_hz``, ``line_g``; no rows for a record too short for a line.
    """
    ay, loop_hz = sense(recording).ay, loop_frequency(recording)
    if loop_hz <= 0 or len(ay) / recording.rate * loop_hz < LEAST_LOOPS:
        return pd.DataFrame(columns=["start_s", "line_hz", "line_g"])
    turn = round(recording.rate / loop_hz)
    longer = np.concatenate([ay, ay[-turn:]])
    rows = []
    for first in np.rint(np.arange(starts) / starts * turn).astype(int):
        line = main_line(longer[first : first + len(ay)], recording.rate)
        rows.append({"start_s": first / recording.rate, "line_hz": line[0], "line_g": line[1]})
    return pd.DataFrame(rows)


def run_metrics(name: str, recording: Recording) -> dict:
    """The row of a run: what ran, what the sensor and the contacts show."""
    scene = recording.meta["scene"]
    signal = sense(recording)
    radius = scene["ring_radius"]
    seconds = len(recording.time) / recording.rate
    cut = getattr(recording, "cut", np.zeros((0, 2)))
    gaps = cut.max(axis=0) if len(cut) else (NAN, NAN)
    return {
        "run": name,
        "rpm": scene["motor_rpm"],
        "ring_radius_m": NAN if radius is None else radius,
        "fidelity": label(recording.meta["fidelity"]),
        "step_s": scene["step"],
        "simulated_s": seconds,
        **sensor_metrics(signal.ay, recording.rate, loop_frequency(recording)),
        "loop_gap_max_m": float(recording.gap.max()),
        "gap_before_projection_m": float(gaps[0]),
        "velocity_gap_m_s": float(gaps[1]),
        "energy_residual": energy_residual(recording),
        "resolved": recording.meta.get("resolved", {}).get("state", "not judged"),
        "clipped_samples": signal.clipped,
        **meshing_summary(recording),
        **first_areas(recording),
    }


def needed_lengths(recording: Recording) -> dict[str, float]:
    """What the recording is too short for, with the record (s) that holds it wherever it begins."""
    period, scene = timing(recording), recording.meta["scene"]
    passage = period.loop + (2 * LONGEST_CONTACT + PASSAGE) * period.turn
    needed = {"dominant peak and standard errors": LEAST_LOOPS * period.loop}
    if len(recording.spells) or scene["spells"]:
        needed["contacts of the recorded pitches"] = passage
    return {what: seconds for what, seconds in needed.items() if period.record < seconds}
