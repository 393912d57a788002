"""One row of numbers a run: the columns of ``metrics.csv``."""

import numpy as np
import pandas as pd

from trackdyn.measure.contact_log import LONGEST, PASSAGE, timing
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_metrics import LEAST_LOOPS, sensor_metrics
from trackdyn.model.record import ENERGY_NAMES
from trackdyn.scene.fidelity import label
from trackdyn.sensor.signals import main_line
from trackdyn.simulation.account import LOSSES, STORED
from trackdyn.simulation.recording import Recording

NAN = float("nan")
STARTS = 16  # of a record in a turn of the loop


def loop_frequency(recording: Recording) -> float:
    """Revolutions of the loop per second that the motor speed asks for, Hz."""
    rig = recording.meta["rig"]
    sprocket = recording.meta["scene"]["motor_rpm"] / rig["sprocket"]["transmission_ratio"] / 60
    return sprocket * rig["sprocket"]["teeth"] / rig["chain"]["pitches"]


def energy_residual(recording: Recording) -> float:
    """What the energy balance leaves open, as a share of the sprocket's work over the record.

    Work of the sprocket minus every dissipation minus the change of kinetic, gravitational and
    bushing energy. The work absorbed by normal contact counts as one term: what Eq. 8 stores comes
    back through it.
    """
    change = dict(zip(ENERGY_NAMES, recording.energy[-1] - recording.energy[0], strict=True))
    work = change["sprocket_work"]
    rest = work - sum(change[name] for name in LOSSES) - sum(change[name] for name in STORED)
    return rest / work if work else NAN


def lines_by_start(recording: Recording, starts: int = STARTS) -> pd.DataFrame:
    """Dominant peak of the FFT, had the record begun elsewhere in a turn of the loop.

    What a later start needs beyond the end of the record is taken one turn earlier: in steady running every turn
    is like the one before. Windows of a longer run show the same amplitudes to 5e-6 g (115 rpm, 90 s).

    Returns
    -------
    DataFrame
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
    """The row of a run: what ran, what it cost, what the sensor and the contacts show."""
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
        "wall_s": recording.wall,
        **sensor_metrics(signal.ay, recording.rate, loop_frequency(recording)),
        "loop_gap_max_m": float(recording.gap.max()),
        "gap_before_projection_m": float(gaps[0]),
        "velocity_gap_m_s": float(gaps[1]),
        "energy_residual": energy_residual(recording),
        "resolved": recording.meta.get("resolved", {}).get("state", "not judged"),
        "clipped_samples": signal.clipped,
        **meshing_summary(recording),
    }


def needed_lengths(recording: Recording) -> dict[str, float]:
    """What the recording is too short for, with the record (s) that holds it wherever it begins."""
    period, scene = timing(recording), recording.meta["scene"]
    passage = period.loop + (2 * LONGEST + PASSAGE) * period.turn
    needed = {"dominant peak and standard errors": LEAST_LOOPS * period.loop}
    if len(recording.spells) or scene["spells"]:
        needed["contacts of the recorded pitches"] = passage
    return {what: seconds for what, seconds in needed.items() if period.record < seconds}
