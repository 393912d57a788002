"""Count how often intervals of a few turns cover the mean of a long run, and how often two of its windows differ.

    python benchmarks/intervals.py [--out results/benchmarks/intervals.csv]

The bars were set before the first run: a coverage within 10 points of 68 and of 95 %, and at most 8 % of pairs that
differ by more than their errors, as `trackdyn compare` judges. Errors are those of scatter, without the step's.
"""

import argparse
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn import Loop, Scene, load_rig, sense
from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import ACCELERATION
from trackdyn.measure.estimators import Sensed
from trackdyn.measure.uncertainty import student, turn_edges, welch_degrees

# rig, motor speed (rev/min), ring (m): a strand with a period of 3.5, 2, and both 5.6 and 11 turns
SCENES = (("paper", 180.0, None), ("bench", 165.0, 0.307), ("parts", 190.0, None))
TURNS, WINDOWS, WAIT = (2, 4, 8), 30, 8.0  # turns of a window, windows, turns before them
WITHIN, DIFFER = 0.10, 0.08


def long_record(scene: Scene, turns: int) -> np.ndarray:
    """Return the y acceleration (g) of the sensor over ``turns``, and a sample."""
    loop = Loop(scene)
    loop.advance(scene.ramp + WAIT * scene.periods.loop)
    edges = turn_edges(10**9, scene.rig.rate * scene.periods.loop)[: turns + 1]
    return np.concatenate([sense(loop.record(count / scene.rig.rate)).ay for count in [*np.diff(edges), 1]])


def rows_of(scene: Scene, ay: np.ndarray, turns: int):
    """Yield measure, coverages of 68 and 95 %, errors over scatter, pairs that differ, and whether all are as asked."""
    edges = turn_edges(len(ay), scene.rig.rate * scene.periods.loop)[::turns]
    windows = [Sensed(ay[a : b + 1], scene.rig.rate, scene.periods.loop_hz) for a, b in pairwise(edges)][:WINDOWS]
    for measure in (measure for measure in ACCELERATION if measure.column.shown or not measure.column.text):
        values, errors = np.transpose([measure.estimator(window) for window in windows])
        if not np.isfinite(errors).all():
            continue
        degrees, off = windows[0].degrees(measure.column.name), np.abs(values - values.mean())
        shares = [float(np.mean(off <= student(degrees, share) * errors)) for share in (0.68, 0.95)]
        differ = np.mean([
            abs(values[i] - values[j]) > (both := np.hypot(errors[i], errors[j]))
            * student(welch_degrees(both, (errors[i], degrees), (errors[j], degrees)))
            for i, j in combinations(range(len(values)), 2)
        ])  # fmt: skip
        met = abs(shares[0] - 0.68) <= WITHIN and abs(shares[1] - 0.95) <= WITHIN and differ <= DIFFER
        scatter = float(values.std(ddof=1))
        ratio = np.sqrt(np.mean(errors**2)) / scatter if scatter else np.inf
        yield measure.column.name, *shares, ratio, scatter / abs(values.mean()), differ, met


def main() -> None:
    """Record, count, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/intervals.csv"))
    out, table = parser.parse_args().out, []
    for name, rpm, ring in SCENES:
        scene = Scene(load_rig(name), rpm, ring, contact_log=False)
        ay = long_record(scene, max(TURNS) * WINDOWS)
        table += [[name, rpm, turns, *row] for turns in TURNS for row in rows_of(scene, ay, turns)]
    columns = "rig rpm turns measure cover_68 cover_95 error_over_scatter scatter_over_mean pairs_that_differ met"
    rows = pd.DataFrame(table, columns=columns.split())
    print(rows.round(4).to_string(index=False))
    write_csv(out, rows)


if __name__ == "__main__":
    main()
