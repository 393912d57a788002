"""An hour of running in chunks: gap, energy residual, statistics and memory must not drift."""

import resource
import sys
from collections.abc import Iterator

import numpy as np
import pandas as pd

from trackdyn.measure.spectra import rms
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.energy_balance import LARGEST_RESIDUAL, open_share
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.signals import normal_signal
from trackdyn_replication.study.extremes.judge import GAP, attempted, below

# Standard errors between the first and the last quarter that still count as no drift; revolutions that are all
# alike may differ by a tenth of the 5 % between the printed differences of the RMS.
STANDARD_ERRORS, ALIKE = 4.0, 0.005
MEMORY_MB = 16.0  # growth of the largest resident memory: the record is reused, so none is expected
MEGABYTE = 2**20 if sys.platform == "darwin" else 2**10  # in units of ``ru_maxrss``


def run_long(rig: Rig, seconds: float, turns: int, rpm: float = 210.0) -> pd.DataFrame:
    """Return a row per chunk: time, largest gap, energy residual, RMS of the sensor's y acceleration (g) and memory."""
    scene = Scene(rig, rpm, duration=1.0, step=1e-4, contact_log=False)
    loop, rate = Loop(scene), rig.rate
    loop.lead_in()
    chunk = round(turns / scene.periods.loop_hz * rate) / rate  # whole turns, so that statistics can be compared
    piece = scene.with_(duration=chunk)
    rows = []
    for _ in range(round(seconds / chunk)):
        record = Recorder(loop, piece, checked=False).finish().record.samples
        ay = normal_signal(record.mean[:, 0], rig, rig.first_sensor.range)
        row = {"time_s": loop.time, "loop_gap_max_m": float(record.gap.max())}
        row |= {"energy_residual": open_share(record.energy, loop.model, chunk)[0]}
        resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE
        row |= {"rms_g": rms(ay), "resident_mb": resident}
        rows.append(row)
    return pd.DataFrame(rows)


def long_run(chunks: pd.DataFrame) -> Iterator[dict]:
    """Yield rows of a long run: its largest gap, residual, drift of the statistics and of the memory."""
    quarter = max(len(chunks) // 4, 1)
    first, last = chunks["rms_g"].iloc[:quarter], chunks["rms_g"].iloc[-quarter:]
    gap, share = float(chunks["loop_gap_max_m"].max()), float(chunks["energy_residual"].abs().max())
    error = np.hypot(*(quarter_of_run.std(ddof=1) / np.sqrt(quarter) for quarter_of_run in (first, last)))
    drift = max(float(STANDARD_ERRORS * error), ALIKE * first.mean())
    grown = float(chunks["resident_mb"].iloc[-1] - chunks["resident_mb"].iloc[0])
    change = float(abs(last.mean() - first.mean()))
    for name, *measured in (
        ("closure error", gap, GAP, "closure error in m"),
        ("energy residual", share, LARGEST_RESIDUAL, "energy residual of a chunk"),
        ("statistics of the first and last quarter", change, drift, "change of the RMS in g"),
        ("memory", max(round(grown), 0), MEMORY_MB, "growth of the memory in MB"),
    ):
        case = f"{chunks['time_s'].iloc[-1]:.0f} s at 210 rpm, {name}"
        yield attempted("long run", case, below, *measured) | {"loop_gap_max_m": gap, "energy_residual": share}
