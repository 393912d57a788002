"""An hour of running in chunks: gap, energy residual, statistics and memory must not drift."""

import sys
from collections.abc import Iterator

import numpy as np
import pandas as pd

from trackdyn.errors import DivergenceError
from trackdyn.integrate.limits import OPEN_SHARE, open_share
from trackdyn.integrate.run import run
from trackdyn.parameters.rig import Rig
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle
from trackdyn.study.extremes.judge import GAP, below, judged
from trackdyn.study.stability import TOLERANCES

# Standard errors between the first and the last quarter that still count as no drift; revolutions that
# are all alike may differ by what counts as a stable statistic elsewhere.
STANDARD_ERRORS = 4.0
# Growth of the largest resident memory, MB: the record is reused, so that nothing should grow.
MEMORY_MB = 16.0


def resident_mb() -> float:
    """Largest resident memory of this process so far, MB; NaN where the platform does not say."""
    try:
        import resource
    except ImportError:
        return float("nan")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def run_long(rig: Rig, seconds: float, turns: int, rpm: float = 210.0) -> pd.DataFrame:
    """A row a chunk: time, largest gap, energy residual, RMS of the sensor's y acceleration and memory.

    Parameters
    ----------
    seconds : float
        Simulated time, s.
    turns : int
        Revolutions of the loop in a chunk: statistics of whole revolutions can be compared.
    """
    scene = Scene(rig, rpm, duration=1.0, step=1e-4, spells=False)
    model, state, work, _ = settle(scene)
    rate, n = rig.sensor.rate, len(state.angle)
    lead = empty_record(1, n, 3)
    for _ in range(round((scene.ramp + scene.lead_in) * rate)):
        if run(model, state, work, lead, 0, 1, scene.stride) >= 0:
            raise DivergenceError(f"the long run left the physical range at t = {state.steps[0] * model.step:.6g} s")
    samples = round(turns / scene.loop_frequency * rate)
    chunk = samples / rate
    record = empty_record(samples, n, 3)
    rows = []
    for _ in range(round(seconds / chunk)):
        if run(model, state, work, record, 0, samples, scene.stride) >= 0:
            raise DivergenceError(f"the long run left the physical range at t = {state.steps[0] * model.step:.6g} s")
        rows.append(
            {
                "time_s": state.steps[0] * model.step,
                "loop_gap_max_m": float(record.gap.max()),
                "energy_residual": open_share(record.energy, model, chunk)[0],
                "rms_g": float(np.sqrt(np.mean(record.raw[:, 1] ** 2))) / 9.81,
                "resident_mb": resident_mb(),
            }
        )
    return pd.DataFrame(rows)


def long_run(chunks: pd.DataFrame) -> Iterator[dict]:
    """Rows of a long run: its largest gap, residual, drift of the statistics and of the memory."""
    quarter = max(len(chunks) // 4, 1)
    first, last = chunks.iloc[:quarter], chunks.iloc[-quarter:]
    seconds = chunks["time_s"].iloc[-1]
    worst_gap = float(chunks["loop_gap_max_m"].max())
    worst_share = float(chunks["energy_residual"].abs().max())
    common = {"loop_gap_max_m": worst_gap, "energy_residual": worst_share}

    def drift():
        error = np.hypot(*(part["rms_g"].std(ddof=1) / np.sqrt(len(part)) for part in (first, last)))
        change = abs(last["rms_g"].mean() - first["rms_g"].mean())
        bound = max(float(STANDARD_ERRORS * error), TOLERANCES["rms_g"] * first["rms_g"].mean())
        return below(float(change), bound, "change of the RMS in g")

    grown = float(chunks["resident_mb"].iloc[-1] - chunks["resident_mb"].iloc[0])
    memory = below(0.0 if np.isnan(grown) else max(round(grown), 0), MEMORY_MB, "growth of the memory in MB")
    for name, found in (
        ("loop gap", lambda: below(worst_gap, GAP, "loop gap in m")),
        ("energy residual", lambda: below(worst_share, OPEN_SHARE, "energy residual of a chunk")),
        ("statistics of the first and last quarter", drift),
        ("memory", lambda: dict(memory)),
    ):
        yield judged("long run", f"{seconds:.0f} s at 210 rpm, {name}", found) | common
