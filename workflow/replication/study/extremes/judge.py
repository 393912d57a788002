"""Extremes: every case completes with its invariants in bounds, or is refused in one sentence.

A case is a row of `COLUMNS`. The outcome is ``completed`` (all invariants in bounds), ``refused`` (an `InputError` when
the scene is built or a `DivergenceError` while it runs, each one sentence), ``marked`` (completed, and says itself that
it is not resolved) or ``defect``: everything else, with the cause in ``reason``. Where a family measures something,
``measure`` names it, ``value`` and ``expected`` are computed and predicted, ``group`` and ``at`` say on which
curve and where on its axis the row stands.
"""

import warnings
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd

from trackdyn.errors import DivergenceError, InputError
from trackdyn.model.record import ENERGY_NAMES
from trackdyn.scene.scene import Scene
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.resolution import check_account, open_share
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate

COMPLETED, MARKED, REFUSED, DEFECT = "completed", "marked", "refused", "defect"
OUTCOMES = (COMPLETED, MARKED, REFUSED, DEFECT)
COLUMNS = (
    "family", "case", "outcome", "reason", "loop_gap_max_m", "energy_residual", "measure", "value", "expected",
    "bound", "group", "at",
)  # fmt: skip

# The bounds, fixed before the runs.
#
# Closure error of a rigid cut: the largest gap that the paper prints, at turns of a body of up to 1e-3 rad a step. The
# closure is projected by one Newton step, which leaves a body's length (0.1 m) times the third power of the turn;
# 1.1e-10 m is that at 1e-3 rad, and larger turns are allowed what follows from twice the turn seen: within a tenth of a
# millisecond it may have been larger.
GAP = 1.1e-10
TURN = 1e-3
# Energy residual and dissipations: the promise of the time loop (`trackdyn.simulation.resolution`), 2 % of the
# energy exchanged, whatever the method.

STARTS = SettledLoops()  # what differs in speed alone begins alike
# the tensioner is locked: one on its spring would leave out the methods and the motion in space that it does not have
FAST = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.1, "spells": False, "tension": "locked"}


def row(family: str, case: str, outcome: str, reason: str = "", **more) -> dict:
    """A row with every column."""
    return dict.fromkeys(COLUMNS, "") | dict.fromkeys(COLUMNS[4:6] + ("value", "expected", "bound", "at"), np.nan) | {
        "family": family, "case": case, "outcome": outcome, "reason": reason, **more,
    }  # fmt: skip


def attempted(family: str, case: str, attempt: Callable[..., dict], *arguments) -> dict:
    """The row of an attempt: ``attempt(*given)`` returns the columns it fills, ``reason`` if a bound is missed.

    Warnings about numbers count as defects, as does every error that is not one of ours in one sentence.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            values = attempt(*arguments)
    except (InputError, DivergenceError) as error:
        if "\n" in str(error):
            return row(family, case, DEFECT, f"more than one sentence: {str(error).splitlines()[0]}")
        return row(family, case, REFUSED, str(error))
    except Exception as error:  # whatever it is, it is a finding
        return row(family, case, DEFECT, f"{type(error).__name__}: {''.join(str(error).splitlines()[:1])}")
    outcome = values.pop("outcome", DEFECT if values.get("reason") else COMPLETED)
    return row(family, case, outcome, **{name: value for name, value in values.items() if name in COLUMNS})


def within_bounds(value: float, expected: float, bound: float, measure: str, **more) -> dict:
    """Columns of a measured number that must stand within ``bound`` of the expected one."""
    missed = not abs(value - expected) <= bound  # a value that is not a number misses too
    reason = f"{measure} is {value:.4g}, not within {bound:.2g} of {expected:.4g}" if missed else ""
    return {"reason": reason, "measure": measure, "value": value, "expected": expected, "bound": bound, **more}


def below(value: float, bound: float, measure: str, **more) -> dict:
    """Columns of a measured number that must not exceed ``bound``."""
    reason = "" if value <= bound else f"{measure} is {value:.3g}, more than {bound:.2g}"
    return {"reason": reason, "measure": measure, "value": value, "bound": bound, **more}


def gap_bound(turn: float) -> float:
    """Largest gap (m) of a rigid cut allowed where bodies turn by ``turn`` (rad) a step."""
    return GAP if turn <= TURN else GAP * (2 * turn / TURN) ** 3


def invariants(scene: Scene, recording: Recording) -> dict:
    """Closure error and energy residual of a recording, and the last bound that it misses.

    The turn of the bodies a step is taken from the recorded configurations, a sample apart.
    """
    if fault := recording.fault():
        return {"reason": fault}
    gap = float(recording.gap.max())
    model, seconds = scene.model, scene.duration
    share, exchanged = open_share(recording.energy, model, seconds)
    values = {"loop_gap_max_m": gap, "energy_residual": share}
    turns = np.abs(np.diff(recording.frame[:, 2:-1], axis=0)) / scene.stride
    allowed = gap_bound(float(turns.max()) if len(turns) else 0.0)
    if scene.closure == "elastic_damping":
        # twice what the spring yields to the strand at the start, and all the energy there is in the spring
        energy = exchanged + float(recording.energy[:, ENERGY_NAMES.index("kinetic")].max())
        allowed = 2 * float(recording.gap[0]) + (2 * energy / scene.rig.closure.stiffness) ** 0.5
    values["reason"] = "" if gap <= allowed else f"the closure error is {gap:.3g} m, more than {allowed:.2g} m"
    try:
        check_account(recording.energy, model, seconds)
    except DivergenceError as missed:  # the run should have said so itself
        values["reason"] = str(missed)
    return values


def samples_a_sample(rig, step: float) -> int:
    """By how much (up to ten times) the sensor may be faster for samples of whole steps, to see every turn."""
    steps = 1.0 / rig.sensor.rate / step if step > 0 else 0.0
    if not np.isfinite(steps) or abs(steps - round(steps)) > 1e-6:
        return 1
    return max(k for k in range(1, 11) if round(steps) % k == 0) if round(steps) else 1


def run_scene(family: str, case: str, rig, rpm: float = 210.0, changes: dict | None = None, **fields) -> dict:
    """Row of a short scene: rig values in ``changes`` (dotted names with two underscores), scene in ``fields``."""
    settings = FAST | {"step": 1e-4} | fields

    def attempt():
        changed = rig.changed(**changes) if changes else rig
        rate = changed.sensor.rate * samples_a_sample(changed, settings["step"])
        scene = Scene(changed.changed(sensor__rate=rate), rpm, **settings, frame_interval=1.0 / rate)
        return invariants(scene, simulate(scene, starts=STARTS))

    return attempted(family, case, attempt)


def as_table(rows: Iterable[dict]) -> pd.DataFrame:
    """Rows in the order of the columns."""
    return pd.DataFrame(list(rows), columns=list(COLUMNS))


def extremes_summary(table: pd.DataFrame) -> pd.DataFrame:
    """Rows, completed, marked, refused and defects of each family, and of all."""
    counts = table.groupby("family", sort=False)["outcome"].value_counts().unstack(fill_value=0)
    counts = counts.reindex(columns=list(OUTCOMES), fill_value=0)
    counts.loc["all"] = counts.sum()
    counts.insert(0, "rows", counts.sum(axis=1))
    return counts.rename(columns={DEFECT: "defects"}).rename_axis("family").reset_index()
