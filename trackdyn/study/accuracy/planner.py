"""The planner: the cheapest fidelity and step that met a tolerance where it was measured."""

import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.errors import InputError, TrackdynError
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import parse_tolerance, shown
from trackdyn.reading import read_text
from trackdyn.simulate import simulate
from trackdyn.study.accuracy.statistics import RELATIVE, SHARES, error_of, scene_name, statistics_of, study_scene
from trackdyn.study.accuracy.trade import COLUMNS, FIDELITIES, FULL_PHYSICS, STATISTIC_REFERENCE
from trackdyn.study.settings import SceneKey

PLANNED = (*RELATIVE, *SHARES)
WORDS = {"scene", "fidelity", "integrator", "measure"}  # columns; the others hold numbers
LARGEST_TABLE = 20_000_000  # bytes; the full study's has 100,000
# A scene nearby may be this much worse than the worst one measured: an error of first order in the step
# changes with the speed as the forces do, and these double from 115 to 210 rpm. (The margin was 1.5 until
# two scenes kept apart showed that this is too little without a ring.)
MARGIN = 2.0
TOLERANCES = (0.005, 0.01, 0.02, 0.05)
PROMISES = [
    "scene", "measure", "tolerance", "achieved_error", "met", "fidelity", "integrator", "step_s", "wall_s_per_s",
]  # fmt: skip


class Plan(NamedTuple):
    """What to run for a tolerance.

    Attributes
    ----------
    fidelity, integrator : str
        Choices of `trade`.
    step : float
        s.
    expected_error : float
        Largest error measured for this kind of scene, relative or in turns of the sprocket.
    wall_s_per_s : float
        Expected cost on the machine that measured.
    warnings : tuple of str
        Where the scene lies outside what was measured.
    """

    fidelity: str
    integrator: str
    step: float
    expected_error: float
    wall_s_per_s: float
    warnings: tuple[str, ...]

    @property
    def fields(self) -> dict:
        """Fields of a `Scene`."""
        return FIDELITIES[self.fidelity] | {"integrator": self.integrator, "step": self.step}


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
        for name in COLUMNS:
            if name not in table:
                raise ValueError(f"lacks the column {name}")
            table[name] = table[name].astype(str) if name in WORDS else pd.to_numeric(table[name])
        if unknown := set(table["fidelity"]) - FIDELITIES.keys():
            raise ValueError(f"names the unknown fidelity {shown(min(unknown))}")
    except (ValueError, OverflowError) as error:  # pandas' own are such, too
        raise InputError(f"{place}: {' '.join(str(error).split())[:200]}; make it with `snakemake -j2 trade`") from None
    return table


def plan(trade: pd.DataFrame, tolerance, measure: str, rpm: float, ring_radius: float | None) -> Plan:
    """The cheapest measured setting that keeps a measure within a tolerance.

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
        Unknown measure, or no measured setting was good enough.
    """
    tolerance = parse_tolerance(tolerance)
    if measure not in PLANNED:
        raise InputError(f"measure = {measure!r} is not accepted: {', '.join(PLANNED)} would do")
    kind = "no ring" if ring_radius is None else "ring"
    here = trade[trade["scene"].str.startswith(f"{kind} ")]
    key = ["fidelity", "integrator", "step_s"]
    failed = here.loc[here["failed"].astype(bool), key].drop_duplicates()
    rows = here[(here["measure"] == measure) & ~here["failed"].astype(bool)]
    if scene_name(rpm, ring_radius) not in set(rows["scene"]):
        # a discretisation error carries over to a scene nearby; what a coarser physics misses need not
        rows = rows[rows["fidelity"] == FULL_PHYSICS]
    scenes = rows["scene"].nunique()
    # an error that happens to pass through zero promises nothing: with a larger step it is taken to be at
    # least that of every smaller one of the same physics
    rows = rows.sort_values("step_s")
    rows = rows.assign(error=rows.groupby(["scene", "fidelity"])["error"].cummax())
    found = rows.groupby(key).agg(
        error=("error", "max"), wall=("wall_s_per_s", "max"), scenes=("scene", "nunique")
    ).reset_index()  # fmt: skip
    found = found[found["scenes"] == scenes].merge(failed.assign(bad=True), on=key, how="left")
    found = found[found["bad"].isna() & (found["error"] * MARGIN <= tolerance)]
    if found.empty:
        least = rows["error"].min() * MARGIN if len(rows) else float("nan")
        raise InputError(
            f"tolerance = {tolerance:g} is not accepted for {measure} ({kind}): the data reach {least:.2g} with their "
            f"margin of {MARGIN:g}; a larger tolerance or a finer step in the data would do"
        )
    best = found.sort_values("wall").iloc[0]
    warnings = []
    measured = rows["scene"].str.extract(r"^(?:no ring|ring (?P<ring>\S+) m) (?P<rpm>\S+) rpm$").apply(
        pd.to_numeric, errors="coerce"
    )
    for name, what, value, unit in (("rpm", "", rpm, "rpm"), ("ring", "a ring of ", ring_radius, "m")):
        low, high = measured[name].min(), measured[name].max()
        if value is not None and not low <= value <= high:
            warnings.append(f"{what}{value:g} {unit} lies outside the measured {low:g} to {high:g} {unit}")
    return Plan(*best[key], float(best["error"]), float(best["wall"]), tuple(warnings))


def verify(rig: Rig, trade: pd.DataFrame, kept_apart: list[SceneKey], turns: int) -> pd.DataFrame:
    """The planner on scenes that the data do not hold: does what it promises come out?

    Returns
    -------
    DataFrame
        ``scene, measure, tolerance, achieved_error, met`` and what was planned. A tolerance that the
        data cannot promise is a row with an empty error and an empty ``met``.
    """
    rows = []
    for rpm, ring in kept_apart:
        name = scene_name(rpm, ring)
        base = study_scene(rig, rpm, ring, turns)
        reference = statistics_of(simulate(base.with_(**STATISTIC_REFERENCE)))
        done: dict[tuple, dict] = {}
        for measure in PLANNED:
            if not np.isfinite(reference[measure]) or (measure in SHARES and reference[measure] == 0):
                continue
            for tolerance in TOLERANCES:
                try:
                    chosen = plan(trade, tolerance, measure, rpm, ring)
                except InputError:
                    rows.append([name, measure, tolerance, np.nan, None, "", "", np.nan, np.nan])
                    continue
                key = chosen[:3]
                if key not in done:
                    try:
                        done[key] = statistics_of(simulate(base.with_(**chosen.fields)))
                    except TrackdynError:
                        done[key] = {}
                error = error_of(measure, done[key].get(measure, np.nan), reference[measure])
                met = bool(np.isfinite(error) and error <= tolerance)
                rows.append([name, measure, tolerance, error, met, *key, chosen.wall_s_per_s])
        print(f"planner: {name}", flush=True)
    return pd.DataFrame(rows, columns=PROMISES)
