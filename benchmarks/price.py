"""Measure the price of a tolerance: CPU time of a plan and its run over that of the cheapest sufficient run.

    python benchmarks/price.py [--out results/benchmarks/price.csv]

The sufficient run has one setting throughout and waits for two turns of the loop (``price_a``), or for the shortest of
several waits that suffices (``price_b``). It ends when its RMS stays within the tolerance of the limit, which is known
only afterwards.
"""

import argparse
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd

from trackdyn import Loop, Scene, load_rig
from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.planner import plan, settings
from trackdyn.measure.uncertainty import LEAST_PASSAGES, Series
from trackdyn.measure.whole_loop import series
from trackdyn.simulation.recorder import Recorder

SCENES = (  # rig, motor speed (rev/min), ring (m)
    ("paper", 115, 0.308), ("paper", 150, 0.3075), ("paper", 195, 0.306), ("paper", 180, None), ("bench", 165, 0.307),
    ("bench", 200, 0.3095), ("parts", 225, 0.308), ("parts", 190, None), ("m113", 90, None),
)  # fmt: skip
TOLERANCES, WAITS = (0.05, 0.02, 0.01), (0.0, 0.5, 1.0, 2.0, 4.0, 7.0)  # waits in turns
COLUMNS = ["rig", "rpm", "ring_radius_m", "tolerance", "error", "cpu_s", "price_a", "price_b"]
LONGEST, STEADY = 6.0, 10.0  # turns of a record; turns until the limit is taken


def recorded(scene: Scene, wait: float, turns: float) -> tuple[Series, float, float]:
    """Return the RMS by passage from ``wait`` turns on, and the CPU seconds until then and of the record."""
    begin = process_time()
    scene = scene.with_(every_link=True, pitches=(), lead_in=0.0, duration=turns * scene.periods.loop)
    loop = Loop(scene)
    loop.advance(scene.ramp + wait * scene.periods.loop)
    at_speed, recorder = process_time(), Recorder(loop, scene, checked=False)
    recorder.finish()
    return series(recorder.recording(), ["rms"])["rms"], at_speed - begin, process_time() - at_speed


def cheapest(scene: Scene, limit: float, tolerance: float, runs: list) -> dict[str, float]:
    """Return CPU seconds of the cheapest sufficient run, after two turns (``a``) and after any of `WAITS` (``b``)."""
    costs = {"a": np.inf, "b": np.inf}
    for (rms, start, record), wait in product(runs, WAITS):
        squares = rms.values[int(wait * scene.rig.chain.pitches) :][: int(LONGEST * scene.rig.chain.pitches)]
        off = np.abs(np.sqrt(np.cumsum(squares) / np.arange(1, len(squares) + 1)) / limit - 1)
        missed = np.flatnonzero(off > tolerance)
        passages = max(missed[-1] + 2 if len(missed) else 0, LEAST_PASSAGES)
        if passages > len(off):
            continue
        cost = start + record / len(rms.values) * (wait * scene.rig.chain.pitches + passages)
        costs = {key: min(value, cost) if key == "b" or wait == 2 else value for key, value in costs.items()}
    return costs


def main() -> None:
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/price.csv"))
    out, table = parser.parse_args().out, []
    for name, rpm, ring in SCENES:
        scene, runs = Scene(load_rig(name), rpm, ring), []
        rms, fine = (recorded(scene.with_(step=scene.time_step / k), STEADY, 2 * LONGEST / k)[0] for k in (1, 4))
        bias = np.subtract(
            *(values.between(0, 3 * scene.rig.chain.pitches - 1).estimate().value for values in (rms, fine))
        )
        limit = rms.estimate().value - 4 / 3 * bias
        for trial in settings(scene, scene.time_step, True)[:2]:  # finer ones cost more
            try:
                runs.append(recorded(scene.with_(**trial.fields), 0.0, WAITS[-1] + LONGEST))
            except TrackdynError as error:
                print(f"{name}, {rpm} rpm, {trial.name}: {error}")
        for tolerance in TOLERANCES:
            begin = process_time()
            try:
                answer = plan(scene, {"rms": tolerance}).run()
            except TrackdynError as error:
                print(f"{name}, {rpm} rpm, {process_time() - begin:.2g} CPU s: {error}")
                continue
            cpu, costs = process_time() - begin, cheapest(scene, limit, tolerance, runs)
            row = name, rpm, ring, tolerance, answer.measures["rms"].value / limit - 1, cpu
            table.append([*row, *(cpu / cost if cost < np.inf else np.nan for cost in costs.values())])
            print(*table[-1], flush=True)
    rows = pd.DataFrame(table, columns=COLUMNS)
    print(
        rows[["price_a", "price_b"]].median(),
        f"within the tolerance: {(rows.error.abs() <= rows.tolerance).sum()} of {len(rows)}",
    )
    write_csv(out, rows)


if __name__ == "__main__":
    main()
