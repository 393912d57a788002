"""Material of the studies of accuracy: scenes of whole revolutions, the statistics of a record, their errors."""

import numpy as np

from trackdyn.measure import uncertainty
from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.sensor import sense, whole_revolutions, whole_samples
from trackdyn.measure.spectra import high_frequency_rms, holds_line, main_line_binfree, rms, standard_deviation
from trackdyn.measure.uncertainty import RELATIVE, SHARES, Series
from trackdyn.measure.whole_loop import series
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording

NAN = float("nan")
# tension in the ladder and in accuracy against cost: motion in space and rk4 have no tensioner on its spring
TENSION = {"tension": "locked"}
BELT_TURNS = 3  # turns of the loop in the record of a belt, which has no transient and no contact
LEAD_IN = 3.0  # s at constant speed before what is compared begins, after a second of starting
# compared as they are
ABSOLUTE = ("loop_gap", "energy_residual")
MEASURES = RELATIVE + SHARES + ABSOLUTE


def study_scene(rig, rpm: float, ring: float | None, turns: int, **fields) -> Scene:
    """A record of so many ``turns`` of the loop after four seconds of running, at ``rpm`` (rev/min) with a ring (m)."""
    duration = whole_samples(rig.rate, turns * Periods.at(rig, rpm).loop + 0.01)
    return Scene(rig, rpm, ring, duration=duration, lead_in=LEAD_IN, **fields)


def statistics_of(recording: Recording) -> dict[str, float]:
    """RMS, SD, dominant peak, RMS at and above 20 Hz (g), contact durations (%), peaks of both arcs (N), closure error
    (m), energy residual. A record of less than two revolutions of the loop has no dominant peak: NaN.

    The RMS and SD are taken over whole revolutions of the loop, the peak is the mean over the passages of the largest
    force.
    """
    loop_hz = recording.periods.loop_hz
    ay = sense(recording).ay
    complete = ay[: whole_revolutions(len(ay), recording.rate, loop_hz)]
    meshing = meshing_summary(recording) if len(recording.contact_log) else {}
    periodic = holds_line(len(ay), recording.rate, loop_hz)
    return {
        "rms": rms(complete),
        "sd": standard_deviation(complete),
        "line": main_line_binfree(ay, recording.rate, expected_hz=loop_hz)[1] if periodic else NAN,
        **{name: meshing.get(f"{name}_pct", NAN) for name in SHARES},
        "high_frequency": high_frequency_rms(complete, recording.rate),
        **{f"{side}_peak": meshing.get(f"{side}_peak_n", NAN) for side in ("left", "right")},
        "loop_gap": float(recording.gap.max()),
        "energy_residual": abs(energy_residual(recording)),
    }


def answers_of(recording: Recording) -> dict[str, Series]:
    """Measures over all links of a recording made with ``every_link``, passage by passage.

    As `statistics_of`, but with what standard errors are made of (`measure.whole_loop`). Closure error and energy
    residual belong to the whole record and have none.
    """
    exact = {"loop_gap": float(recording.gap.max()), "energy_residual": abs(energy_residual(recording))}
    return series(recording) | {name: Series(np.array([value]), np.array([0])) for name, value in exact.items()}


def scale_of(measure: str, reference: float) -> float:
    """Value that an error is a part of, as a tolerance is (`measure.uncertainty.scale_of`); 1 for gap and residual."""
    return 1.0 if measure in ABSOLUTE else uncertainty.scale_of(measure, reference)
