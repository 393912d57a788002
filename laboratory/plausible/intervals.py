"""Do intervals of two and of four turns hold what they promise? Windows in a row of one run, on three rigs."""

from trackdyn.sweeps.snakemake_job import run_job

from itertools import combinations

import numpy as np
import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import ACCELERATION
from trackdyn.measure.estimators import Sensed
from trackdyn.measure.sensor import sense
from trackdyn.measure.uncertainty import student, welch_degrees
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

# rig, motor speed (rev/min), ring (m): links that nearly repeat themselves, a ring, and a strand that scatters
SCENES = (("paper", 180.0, None), ("bench", 165.0, 0.307), ("parts", 190.0, None))
TURNS, WINDOWS, WAIT = (2, 4), 30, 8.0  # turns of a window, windows, turns before them
CONFIDENCES = (0.68, 0.95)
WITHIN = 0.10  # bar: how far a coverage may be from what is promised; 30 windows tell 0.68 to 0.085
DIFFER = 0.08  # bar: share of pairs of windows of one run that differ by more than their errors
COLUMNS = [
    "rig", "rpm", "ring_radius_m", "turns", "windows", "measure", "confidence", "coverage", "error_over_scatter",
    "within", "pairs_that_differ",
]  # fmt: skip


def long_record(scene: Scene, turns: int = max(TURNS) * WINDOWS) -> np.ndarray:
    """Return the y acceleration (g) of the sensor over so many turns, each of as many samples."""
    loop = Loop(scene)
    loop.advance(scene.ramp + WAIT * scene.periods.loop)
    seconds = turn_samples(scene) / scene.rig.rate
    return np.concatenate([sense(loop.record(seconds)).ay for _ in range(turns)])


def turn_samples(scene: Scene) -> int:
    """Return the samples of a turn of the loop."""
    return round(scene.rig.rate * scene.periods.loop)


def coverage_rows(scene: Scene, ay: np.ndarray) -> list[list]:
    """Return coverages of the intervals in a `long_record` by turns of a window, measure and confidence (`COLUMNS`).

    The truth is the mean of all windows; intervals are of scatter alone, without what the step adds. Where turns make
    up for each other an interval is too wide, which ``error_over_scatter`` shows: the root of the mean square of
    errors over the standard deviation of the windows. Pairs of windows differ as in `fieldtest.compare`: by more than
    Student's factor for the degrees of freedom of both errors.
    """
    turn, rows = turn_samples(scene), []
    for turns in TURNS:
        windows = len(ay) // (turns * turn)
        # a sample more, so that turns that end between two samples count
        records = [ay[k * turns * turn :][: turns * turn + 1] for k in range(windows)]
        sensed = [Sensed(record, scene.rig.rate, scene.periods.loop_hz) for record in records]
        for measure in (measure for measure in ACCELERATION if measure.compared):
            values, errors = np.transpose([measure.sensed(window) for window in sensed])
            degrees = sensed[0].degrees(measure.column)
            if not np.isfinite(errors).all():
                continue
            off, scatter = np.abs(values - values.mean()), float(values.std(ddof=1))
            wide = float(np.sqrt(np.mean(errors**2))) / scatter if scatter else np.inf
            differ = np.mean([
                abs(values[i] - values[j]) > (both := np.hypot(errors[i], errors[j]))
                * student(welch_degrees(both, (errors[i], degrees), (errors[j], degrees)))
                for i, j in combinations(range(windows), 2)
            ])  # fmt: skip
            for confidence in CONFIDENCES:
                covered = float(np.mean(off <= student(degrees, confidence) * errors))
                within = confidence - WITHIN <= covered <= confidence + WITHIN
                rows.append([turns, windows, measure.column, confidence, covered, wide, within, float(differ)])
    return rows


@run_job
def main(job) -> None:
    """Rule `coverage`."""
    rows = []
    for name, rpm, ring in SCENES:
        scene = Scene(load_rig(name), rpm, ring, contact_log=False)
        rows += [[name, rpm, ring, *row] for row in coverage_rows(scene, long_record(scene))]
    write_csv(job.output[0], pd.DataFrame(rows, columns=COLUMNS))
