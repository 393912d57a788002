"""The planner: the cheapest fidelity, step and duration that keep a tolerance, by what was measured.

The error of an answer has two parts. That of the setting was measured against the limit over steps; it is taken at its
upper end, two standard errors higher. That of the record falls as one over the root of its passages where motion
scatters, and is nothing where it repeats; it is taken as half of the 95 % interval that the record will show. Their
sum must keep the tolerance. Between scenes that were measured both are taken twice as large as in the worst of them.
"""

import io
from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import t as student

from replication.study.accuracy.limit import SURE
from replication.study.accuracy.statistics import (
    LEAD_IN,
    RELATIVE,
    SHARES,
    TENSION,
    answers_of,
    scale_of,
    statistic_error,
    study_scene,
    whole_samples,
)
from replication.study.accuracy.trade import COLUMNS, FIDELITIES, FULL_PHYSICS, limits_of, run_answer, timed_run
from replication.study.settings import SceneKey, scene_name
from trackdyn.errors import InputError, TrackdynError
from trackdyn.files import read_text
from trackdyn.measure.stopping import LEAST
from trackdyn.measure.uncertainty import CONFIDENCE
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import parse_tolerance, shown

# with a ring, right arcs touch in few scenes or none: too little to promise their peaks by
PLANNED = (*(name for name in RELATIVE if name != "right_peak"), *SHARES)
WORDS = {"scene", "fidelity", "integrator", "measure"}  # columns; the others hold numbers
LARGEST_TABLE = 20_000_000  # bytes; the full study's has 300,000
LARGEST_NUMBER = 1e12  # no column's values come near it, and no product of three of them overflows
KEY = ["fidelity", "integrator", "step_s"]
# A scene nearby may be this much worse than the worst one measured: an error of first order in the step
# changes with the speed as the forces do, and these double from 115 to 210 rpm. (The margin was 1.5 until
# two scenes kept apart showed that this is too little without a ring.)
MARGIN = 2.0
LONGEST = 600.0  # s: no record is planned longer
STARTING = 1.0  # s, the ramp of the scenes that were measured
TOLERANCES = (0.005, 0.01, 0.02, 0.05)
PROMISES = [
    "scene",
    "measure",
    "tolerance",
    "achieved_error",
    "limit_error",
    "met",
    "fidelity",
    "integrator",
    "step_s",
    "duration_s",
    "expected_error",
    "cpu_s",
    "reason",
]


class Plan(NamedTuple):
    """What to run for a tolerance.

    Attributes
    ----------
    fidelity, integrator : str
        Choices of `trade`.
    step : float
        s.
    passages : int
        Values that the mean shall be taken over: passages of all links, or revolutions of one.
    duration : float
        s to record of all links (`Scene.every_link`), after ``LEAD_IN`` at constant speed.
    of_setting, of_record : float
        Both parts of the error that is expected at most, relative or in turns of the sprocket.
    cpu_s : float
        Expected CPU time of the whole answer on the machine that measured.
    warnings : tuple of str
        Where the scene lies outside what was measured.
    """

    fidelity: str
    integrator: str
    step: float
    passages: int
    duration: float
    of_setting: float
    of_record: float
    cpu_s: float
    warnings: tuple[str, ...]

    @property
    def fields(self) -> dict:
        """Fidelity and step as fields of a `Scene`."""
        return FIDELITIES[self.fidelity] | {"integrator": self.integrator, "step": self.step}

    def one_link(self, rig: Rig, rpm: float) -> float:
        """Duration of a record of the sensor's link alone (s): a revolution for what all links do in a passage."""
        return whole_samples(rig, self.passages * rig.loop_period(rpm))


def load_trade(path: Path | str | None = None) -> pd.DataFrame:
    """The measured data: ``results/trade.csv``, else the short form.

    Raises
    ------
    InputError
        No such file, or not one of ours.
    """
    places = [path] if path else [Path("results/trade.csv"), Path("results/short/trade.csv")]
    place = next((place for place in places if path or place.exists()), None)
    if place is None:
        raise InputError(
            f"{places[0]}: no measured data; `snakemake -j2 trade` makes them, `make quick` a short form for "
            "--data results/quick/short/trade.csv"
        )
    text = read_text(place, "table of measured data", LARGEST_TABLE)
    try:
        table = pd.read_csv(io.StringIO(text))
        if lacking := [name for name in COLUMNS if name not in table]:
            raise ValueError(f"lacks the column {lacking[0]}")
        if table.empty:
            raise ValueError("holds no rows")
        for name in COLUMNS:
            table[name] = table[name].map(str) if name in WORDS else pd.to_numeric(table[name]).astype(float)
            if name not in WORDS and (table[name].abs() > LARGEST_NUMBER).any():
                raise ValueError(f"{name} = {table[name].abs().max():g}: at most {LARGEST_NUMBER:g}")
        table["failed"] = table["failed"].astype(bool)
        if unknown := set(table["fidelity"]) - FIDELITIES.keys():
            raise ValueError(f"names the unknown fidelity {shown(min(unknown))}")
    except (ValueError, OverflowError) as error:  # pandas' own are such, too
        raise InputError(f"{place}: {' '.join(str(error).split())[:200]}; make it with `snakemake -j2 trade`") from None
    return table


def record_error(scatter: float, passages) -> np.ndarray:
    """Half of the 95 % interval of a mean of so many passages, by batch means (`measure.uncertainty.batch_error`)."""
    passages = np.asarray(passages)
    batches = passages // np.sqrt(passages).astype(int)
    return student.ppf(0.5 + CONFIDENCE / 2, batches - 1) * scatter / np.sqrt(passages)


def seconds_of(start, cpu_per_s, duration):
    """CPU seconds of an answer: to settle the loop, to start it, to leave the lead-in out, and to record."""
    return start + cpu_per_s * (STARTING + LEAD_IN + duration)


def _candidates(here: pd.DataFrame, measure: str, name: str) -> tuple[pd.DataFrame, float]:
    """Settings that ran in every scene that counts for one, with the errors of the worst; and the margin on them."""
    rows = here[(here["measure"] == measure) & ~here["failed"]]
    margin = 1.0 if name in set(rows["scene"]) else MARGIN
    if margin == 1.0:
        rows, here = rows[rows["scene"] == name], here[here["scene"] == name]
    else:
        # a discretisation error carries over to a scene nearby; what a coarser physics misses need not
        rows = rows[rows["fidelity"] == FULL_PHYSICS]
    # an error that happens to pass through zero promises nothing: with a larger step it is taken to be at
    # least that of every smaller one of the same physics
    rows = rows.sort_values("step_s").assign(upper=rows["error"] + SURE * rows["uncertainty"])
    rows = rows.assign(upper=rows.groupby(["scene", "fidelity"])["upper"].cummax())
    found = rows.groupby(KEY).agg(
        upper=("upper", "max"), scatter=("scatter", "max"), unused=("unused", "max"), start=("start_cpu_s", "max"),
        cpu=("cpu_s_per_s", "max"), scenes=("scene", "nunique"),
    ).reset_index()  # fmt: skip
    found = found[found["scenes"] == rows["scene"].nunique()]
    failed = here.loc[here["failed"], KEY].drop_duplicates().assign(bad=True)
    found = found.merge(failed, on=KEY, how="left")
    return found[found["bad"].isna() & found["scatter"].notna()], margin


def plan(trade: pd.DataFrame, tolerance, measure: str, rpm: float, ring_radius: float | None) -> Plan:
    """The cheapest setting and duration that keep a measure within a tolerance.

    Parameters
    ----------
    trade : DataFrame
        Rows of ``trade.csv``.
    tolerance : str or float
        Relative error, or part of a sprocket turn for shares: ``2%`` or 0.02.
    measure : str
        One of ``PLANNED``.
    rpm, ring_radius : float, float or None
        The scene: motor speed (rev/min), radius (m) or None for no ring.

    Raises
    ------
    InputError
        Unknown measure, or no measured setting is good enough; says what stands in the way.
    """
    tolerance = parse_tolerance(tolerance)
    if measure not in PLANNED:
        raise InputError(f"measure = {measure!r}: choose {', '.join(PLANNED)}")
    kind = "no ring" if ring_radius is None else "ring"
    here = trade[trade["scene"].str.startswith(f"{kind} ")]
    measured = (
        here["scene"]
        .str.extract(r"^(?:no ring|ring (?P<ring>\S+) m) (?P<rpm>\S+) rpm$")
        .apply(pd.to_numeric, errors="coerce")
    )
    # the chain moves by a pitch in a time that is inverse to the speed, the same on every scene of a rig
    span = float((here["passage_s"] * measured["rpm"]).median()) / rpm if rpm > 0 else np.nan
    found, margin = _candidates(here, measure, scene_name(rpm, ring_radius))
    refused = f"tolerance = {tolerance:g} for {measure} ({kind}): "
    if found.empty or not span > 0:
        raise InputError(refused + "no setting ran in every scene of the data; choose another measure or add data")
    left = tolerance - margin * found["upper"]
    if not (left > 0).any():
        least = margin * found["upper"].min()
        raise InputError(
            f"{refused}the finest setting of the data leaves {least:.2g}, with a margin of "
            f"{margin:g}; use a larger tolerance or add a "
            "finer step to the data"
        )
    passages = np.arange(LEAST, max(int(LONGEST / span), LEAST) + 1)
    best, needed = None, np.inf
    for (_, row), rest in zip(found[left > 0].iterrows(), left[left > 0], strict=True):
        enough = record_error(margin * row["scatter"], passages) <= rest
        if not enough.any():
            needed = min(needed, float(record_error(margin * row["scatter"], passages[-1])) + margin * row["upper"])
            continue
        count = int(passages[np.argmax(enough)])
        duration = ceil(1000 * (count + row["unused"] + 0.5) * span) / 1000
        cpu = seconds_of(row["start"], row["cpu"], duration)
        if best is None or cpu < best.cpu_s:
            of_record = float(record_error(margin * row["scatter"], count))
            best = Plan(*row[KEY], count, duration, margin * row["upper"], of_record, float(cpu), ())
    if best is None:
        raise InputError(f"{refused}{LONGEST:g} s of record still scatter by {needed:.2g}; use a larger tolerance")
    warnings = []
    for name, what, value, unit in (("rpm", "", rpm, "rpm"), ("ring", "a ring of ", ring_radius, "m")):
        low, high = measured[name].min(), measured[name].max()
        if value is not None and not low <= value <= high:
            warnings.append(f"{what}{value:g} {unit} lies outside the measured {low:g} to {high:g} {unit}")
    return best._replace(warnings=tuple(warnings))


def verify_promises(
    rig: Rig,
    trade: pd.DataFrame,
    kept_apart: list[SceneKey],
    turns: int,
    steps: list[float],
    tolerances: Sequence[float] = TOLERANCES,
    **fields: Any,
) -> pd.DataFrame:
    """The planner on scenes that the data do not hold: does what it promises come out?

    Each setting is run once for the longest record that was planned with it; shorter ones are its beginning. Limits are
    extrapolated from records of ``turns`` revolutions of the loop with ``steps`` (s). Errors of ``tolerances`` are
    asked for; ``fields`` are those of every scene.

    Returns
    -------
    DataFrame
        ``PROMISES``: ``achieved_error`` against the limit of that very scene, whose own standard error is
        ``limit_error``. A tolerance that cannot be promised is a row with an empty error, an empty ``met``, and its
        ``reason``.
    """
    rows = []
    for rpm, ring in kept_apart:
        name, base = scene_name(rpm, ring), study_scene(rig, rpm, ring, turns, every_link=True, **(TENSION | fields))
        limits = limits_of({step: run_answer(base.with_(step=step)) for step in steps})
        plans: dict[tuple, list] = {}
        for measure in (m for m in PLANNED if m in limits and (m in RELATIVE or limits[m].value)):
            for tolerance in tolerances:
                try:
                    chosen = plan(trade, tolerance, measure, rpm, ring)
                    plans.setdefault(chosen[:3], []).append((measure, tolerance, chosen))
                except InputError as error:
                    reason = str(error).partition("): ")[2].partition(";")[0]
                    rows.append({"scene": name, "measure": measure, "tolerance": tolerance, "reason": reason})
        for asked in plans.values():
            rows += _kept(rig, base, limits, name, asked)
        print(f"planner: {name}", flush=True)
    table = pd.DataFrame(rows, columns=PROMISES)
    order = {measure: k for k, measure in enumerate(PLANNED)}
    return table.sort_values(
        ["scene", "measure", "tolerance"], key=lambda c: c.map(order) if c.name == "measure" else c, ignore_index=True
    )


def _kept(rig: Rig, base, limits: dict, name: str, asked: list) -> list[dict]:
    """Rows of all promises that were planned with one setting in one scene."""
    longest = max(chosen.duration for *_, chosen in asked)
    try:
        recording = timed_run(base.with_(duration=whole_samples(rig, longest), **asked[0][2].fields))[0]
    except TrackdynError:
        recording = None
    rows = []
    for measure, tolerance, chosen in asked:
        limit, error = limits[measure], np.nan
        if recording is not None:
            span = rig.loop_period(base.motor_rpm) / rig.chain.pitches
            found = answers_of(recording, int(chosen.duration / span + 1e-6)).get(measure)
            error = statistic_error(measure, found.estimate().value, limit.value) if found else np.nan
        rows.append(
            {
                "scene": name,
                "measure": measure,
                "tolerance": tolerance,
                "achieved_error": error,
                "limit_error": limit.error / scale_of(measure, limit.value),
                "met": bool(np.isfinite(error) and error <= tolerance),
                "fidelity": chosen.fidelity,
                "integrator": chosen.integrator,
                "step_s": chosen.step,
                "duration_s": chosen.duration,
                "expected_error": chosen.of_setting + chosen.of_record,
                "cpu_s": chosen.cpu_s,
            }
        )
    return rows
