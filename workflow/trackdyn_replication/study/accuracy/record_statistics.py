"""Scenes of whole revolutions for the studies of accuracy, statistics of a record, and their errors."""

import numpy as np

from trackdyn.measure.catalogue import ABSOLUTE, NAMED
from trackdyn.measure.estimators import meshing_summary, sensor_metrics
from trackdyn.measure.sensor import sense, whole_samples
from trackdyn.measure.uncertainty import Series
from trackdyn.measure.whole_loop import series
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.recording import Recording

NAN = float("nan")
# tension in the ladder and in accuracy against cost: motion in space and rk4 have no tensioner on its spring
TENSION = {"tension": "locked"}
BELT_TURNS = 3  # turns of the loop in the record of a belt, which has no transient and no contact
LEAD_IN = 3.0  # s at constant speed before the compared record begins, after a second of starting


def study_scene(rig, rpm: float, ring: float | None, turns: int, **fields) -> Scene:
    """Return a scene of ``turns`` of the loop after four seconds of running, at ``rpm`` (rev/min) with a ring (m)."""
    duration = whole_samples(rig.rate, turns * Periods.at(rig, rpm).loop + 0.01)
    return Scene(rig, rpm, ring, duration=duration, lead_in=LEAD_IN, **fields)


def statistics_of(recording: Recording) -> dict[str, float]:
    """Return measures of a record by name (`measure.catalogue`), without sign; NaN if undefined."""
    row = sensor_metrics(sense(recording).ay, recording.rate, recording.periods.loop_hz) | meshing_summary(recording)
    row |= {"loop_gap_max_m": float(recording.gap.max()), "energy_residual": energy_residual(recording)}
    return {name: abs(row[measure.column.name]) for name, measure in NAMED.items()}


def answers_of(recording: Recording) -> dict[str, Series]:
    """Return measures over all links of a recording made with ``every_link``, per passage, as series for errors."""
    exact = statistics_of(recording)
    return series(recording) | {name: Series(np.array([exact[name]]), np.array([0])) for name in ABSOLUTE}
