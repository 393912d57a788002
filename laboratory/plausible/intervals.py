"""Do intervals of two and of four turns hold what they promise? Windows in a row of one run, on three rigs."""

from trackdyn.sweeps.snakemake_job import run_job

import numpy as np
import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import ACCELERATION
from trackdyn.measure.estimators import Sensed
from trackdyn.measure.sensor import sense
from trackdyn.measure.uncertainty import student
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

# rig, motor speed (rev/min), ring (m): links that nearly repeat themselves, a ring, and a strand that scatters
SCENES = (("paper", 180.0, None), ("bench", 165.0, 0.307), ("parts", 190.0, None))
TURNS, WINDOWS, WAIT = (2, 4), 30, 8.0  # turns of a window, windows, turns before them
CONFIDENCES = (0.68, 0.95)
WITHIN = 0.10  # bar: how far a coverage may be from what is promised; 30 windows tell 0.68 to 0.085
COLUMNS = ["rig", "rpm", "ring_radius_m", "turns", "measure", "confidence", "coverage", "error_over_scatter", "within"]


def coverage_rows(scene: Scene, windows: int = WINDOWS) -> list[list]:
    """Coverage of the intervals of a scene by turns of a window, measure and confidence (`COLUMNS` from ``turns`` on).

    The truth is the mean of all windows; intervals are of scatter alone, without what the step adds. Where turns make
    up for each other an interval is too wide, which ``error_over_scatter`` shows: the root of the mean square of
    errors over the standard deviation of the windows.
    """
    loop, rate, loop_hz = Loop(scene), scene.rig.rate, scene.periods.loop_hz
    loop.advance(scene.ramp + WAIT * scene.periods.loop)
    turn = round(rate / loop_hz)
    ay = np.concatenate([sense(loop.record(turn / rate)).ay for _ in range(max(TURNS) * windows)])
    rows = []
    for turns in TURNS:
        # a sample more, so that turns that end between two samples count
        sensed = [Sensed(ay[k * turns * turn :][: turns * turn + 1], rate, loop_hz) for k in range(windows)]
        for measure in (measure for measure in ACCELERATION if measure.compared):
            values, errors = np.transpose([measure.sensed(window) for window in sensed])
            degrees = sensed[0].degrees(measure.column)
            if not np.isfinite(errors).all():
                continue
            off, scatter = np.abs(values - values.mean()), float(values.std(ddof=1))
            wide = float(np.sqrt(np.mean(errors**2))) / scatter if scatter else np.inf
            for confidence in CONFIDENCES:
                covered = float(np.mean(off <= student(degrees, confidence) * errors))
                low = covered >= confidence - WITHIN
                rows.append([turns, measure.column, confidence, covered, wide, low and covered <= confidence + WITHIN])
    return rows


@run_job
def main(job) -> None:
    """Rule `coverage`."""
    rows = []
    for name, rpm, ring in SCENES:
        scene = Scene(load_rig(name), rpm, ring, contact_log=False)
        rows += [[name, rpm, ring, *row] for row in coverage_rows(scene)]
    write_csv(job.output[0], pd.DataFrame(rows, columns=COLUMNS))
