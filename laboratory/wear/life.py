"""The life of a rig: what wears, step by step, until a bound is reached or the worn rig leaves the model.

The depths of a worn rig (`law.Depths`) are the state, the distance that the chain ran (m) is the time, and the rate at
a state is a whole simulation: the worn rig settled, run until its contacts are steady, and its work of friction
distributed. Heun's method takes steps of a length that the change they make allows: in depth, in the shares of contact,
and in what the two rates of a step differ by.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, takewhile
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from laboratory.wear.contour import contours, worn_rig
from laboratory.wear.law import Coefficients, Depths
from laboratory.wear.work import distribute
from trackdyn.errors import DivergenceError, InputError, shown
from trackdyn.files import keep, refuse_unwritable
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.stopping import refuse_undriven, run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.stop_rule import StopRule, steady_fields
from trackdyn.simulation.loop import Loop
from trackdyn.sources import module_hash
from trackdyn.sweeps.store import DONE, Store, key_of
from trackdyn.sweeps.table import write_table

# one turn of the sprocket; rates and forces of worn rigs scatter by some per cent, and a step of the wear spans several
RULE = StopRule(share_pct=0.5, force=0.03, passages=13, longest_turns=2)
FOLLOW = 2.5e-4  # m by which the arcs may miss a worn flank where it is worn
SMALLEST = 1 / 256  # of the step that a change asks for: what changes more within it is a jump, and is stepped over
MOST_STEPS = 400
SHARES = ("left_share_pct", "right_share_pct", "ring_share_pct")
SUMMARY = (*SHARES, *(f"{side}_{name}" for side in ("left", "right", "ring") for name in ("rms_n", "peak_n")))
SENSED = ("rms", "sd", "line")


class Limits(NamedTuple):
    """Change that one step may make: of the ring's radius and of any other depth (m), of a share (points of a turn);
    and the error of it, relative to that change.
    """

    ring: float = 5e-4
    depth: float = 1.5e-4
    share: float = 6.0
    error: float = 0.2

    def times(self, factor: float) -> "Limits":
        """Limits that give steps of ``factor`` times the length."""
        return Limits(self.ring * factor, self.depth * factor, self.share * factor, self.error)


class Until(NamedTuple):
    """Where a life ends: at a radius of the ring, or at a distance (m)."""

    what: str
    value: float


UNITS = {"ring": {"m": 1.0, "mm": 1e-3}, "distance": {"m": 1.0, "km": 1e3}}


def parse_until(text: str) -> Until:
    """Read a bound such as ``ring 0.303 m`` or ``distance 5000 km``, whose value is in m."""
    try:
        what, value, unit = str(text).split()
        if 0 < (number := float(value)) < 1e9:
            return Until(what, number * UNITS[what][unit])
    except (ValueError, KeyError):
        pass
    raise InputError(f"until = {shown(text)}: expected a bound such as 'ring 0.303 m' or 'distance 5000 km'")


class Found(NamedTuple):
    """Rates at a state: what wears for each unit of distance, what is watched beside the depths, and what is told."""

    rate: np.ndarray
    watched: np.ndarray
    known: Mapping[str, Any] = MappingProxyType({})


@dataclass
class Walk:
    """Heun's method with steps that the change within them controls."""

    find: Callable[[np.ndarray], Found]  # state to `Found`; `InputError` or `DivergenceError` where there is none
    scale: np.ndarray  # change of each entry that one step may make
    watch: np.ndarray  # the same of what is watched
    error: float = 0.2  # difference of the two ends of a step, relative to the largest change that it may make
    evaluations: int = field(default=0)

    def longest(self, found: Found) -> float:
        """Distance in which the rates of a state make the largest change that a step may make; infinite at rest."""
        speed = float((np.abs(found.rate) / self.scale).max(initial=0.0))
        return 1.0 / speed if speed else float("inf")

    def step(self, y: np.ndarray, found: Found, length: float) -> tuple[float, np.ndarray, Found, Found]:
        """One step of at most ``length``: its length, the new state, what is found there, and at its prediction."""
        least = SMALLEST * self.longest(found)
        while True:
            try:
                ahead = self.look(y + length * found.rate)
                change = length * np.abs(ahead.rate - found.rate) / 2 / self.scale
                wrong = max(
                    float(change.max(initial=0.0)) / self.error,
                    float((np.abs(ahead.watched - found.watched) / self.watch).max(initial=0.0)),
                )
                if wrong <= 1.0 or length <= least:
                    new = y + length * (found.rate + ahead.rate) / 2
                    return length, new, self.look(new), ahead
            except (InputError, DivergenceError):
                if length <= least:
                    raise
                wrong = 4.0
            length = max(length * max(0.9 / wrong, 0.25), least)

    def look(self, y: np.ndarray) -> Found:
        self.evaluations += 1
        return self.find(y)


def crossing(goal: float, rate: float, ahead: float, length: float) -> float | None:
    """Where within a step of Heun's method a change reaches ``goal``; None if it does not.

    The change is ``s rate + s^2 (ahead - rate) / (2 length)``.
    """
    bend = (ahead - rate) / (2 * length)
    within = [s.real for s in np.roots([bend, rate, -goal]) if abs(s.imag) < 1e-12 * length and 0 <= s.real <= length]
    return float(min(within)) if within else None


@dataclass
class Worn:
    """The rates of a rig: a function of its depths."""

    rig: Rig  # as new; the tension is set with its new ring
    rpm: float  # motor speed, rev/min
    coefficients: Coefficients
    fields: dict  # of the scene: tension, step, integrator and the like
    rule: StopRule = RULE  # when a run is steady

    def __post_init__(self):
        if not self.rpm > 0:
            raise InputError(f"rpm = {self.rpm!r}: must be above 0, a chain at rest does not wear")
        self.depths = Depths(contours(self.rig.groove_profile))
        self._shift: float | None = None

    def __call__(self, y: np.ndarray) -> Found:
        d = self.depths
        rig, missed = worn_rig(self.rig, d.contours, [y[f] for f in d.flanks], y[d.arcs], float(y[d.bushing]))
        if missed > FOLLOW:
            raise InputError(f"the arcs miss the worn flank by {1e3 * missed:.2g} mm, more than {1e3 * FOLLOW:g} mm")
        radius = None if self.rig.ring_radius is None else self.rig.ring_radius - float(y[d.ring])
        steady = steady_fields(rig, self.rpm, self.rule)
        scene = Scene(rig, self.rpm, radius, sliding=True, every_link=True, **steady, **self.fields)
        refuse_undriven(scene)
        if scene.fidelity["space"].setting == "spatial":
            raise InputError("scene: space = 'spatial': wear needs wheels in the plane of the chain")
        loop = Loop(scene)
        if scene.tension == "locked":  # the wheel stays where the new chain put it
            if self._shift is None:
                new = loop if not y.any() else Loop(Scene(self.rig, self.rpm, **self.fields))
                self._shift = float(new.layout["tensioner_shift_m"])
            loop.shift_tensioner(self._shift)
        recording, converged = run_steady(loop, self.rule)
        worked = distribute(loop, d.contours, [c.worn(y[f]) for c, f in zip(d.contours, d.flanks, strict=True)])
        summary, felt = meshing_summary(recording), whole_loop(recording)
        per_km = 1e3 / worked.distance
        known = {name: summary[name] for name in SUMMARY} | {
            "ring_radius_m": float("nan") if radius is None else radius, "longer_pitch_m": 2 * float(y[d.bushing]),
            "left_depth_m": float(y[d.flanks[0]].max()), "right_depth_m": float(y[d.flanks[1]].max()),
            "arc_depth_m": float(y[d.arcs].max()), "misfit_m": missed, "steady": converged,
            "work_teeth_j_km": float(worked.areas.sum()) * per_km, "work_ring_j_km": worked.ring * per_km,
            "work_bushings_j_km": worked.bushing * per_km,
        }  # fmt: skip
        for name in SENSED:
            known |= {f"{name}_g": felt[name].value, f"{name}_half_width_g": felt[name].half_width}
        return Found(d.rates(rig, radius, worked, self.coefficients), np.array([known[name] for name in SHARES]), known)

    def goal(self, until: Until) -> tuple[int, float]:
        """Return the entry of the state that reaches a bound, and its value there, m."""
        if until.what == "distance":
            return self.depths.distance, until.value
        if self.rig.ring_radius is None:
            raise InputError("until = 'ring ...': the rig has no ring; give a distance")
        if (loss := self.rig.ring_radius - until.value) > 0:
            return self.depths.ring, loss
        raise InputError(f"until = ring {until.value:g} m is not below the new ring, {self.rig.ring_radius:g} m")


def live(
    worn: Worn,
    until: Until,
    limits: Limits = Limits(),
    out: Path | str | None = None,
    overwrite: bool = False,
    tick: Callable[[dict], object] = lambda row: None,
) -> pd.DataFrame:
    """Compute the wear of a rig over its life, one row per state.

    Parameters
    ----------
    worn : Worn
        Rates of wear of the rig.
    until : Until
        Ring radius or distance at which the life ends.
    limits : Limits
        Control of the steps.
    out : path or None
        Table (.parquet) that is written after every step. States are kept in a folder beside it (.rows), from which the
        same call resumes.
    overwrite : bool
        Replace a table that is there and not of this life.
    tick : function
        Called with every new row.

    Returns
    -------
    DataFrame
        ``distance_km``, what has worn, shares, forces and what a sensor feels; ``depths`` and ``rates`` (m, and m for
        each m that the chain runs), ``next_m``, and ``end``: why the last row is the last one.

    Raises
    ------
    InputError
        The new rig cannot run, ``until`` lies behind it, or ``out`` holds another result of trackdyn wear.
    """
    request = key_of(
        module_hash(__name__), worn.rig.model_dump(), worn.rpm, worn.coefficients.model_dump(),
        worn.fields, worn.rule.model_dump(), until, limits,
    )  # fmt: skip
    rows: list[dict] = []
    store = None
    if out is not None:
        refuse_unwritable(out)
        keep(out)
        store = Store(Path(out).with_suffix(".rows"), lambda values: _valid(values, worn.depths.size))
        rows = _begun(store, request)
        if Path(out).exists() and not rows and not overwrite:
            raise InputError(f"{out}: exists and is not of this life; give another name, or --overwrite to replace it")
    for row in _rows(worn, until, limits, rows):
        if rows and row["distance_km"] == rows[-1]["distance_km"]:  # the same state, and why it is the last one
            rows.pop()
        if store is not None:
            of = {"state": DONE, "reason": "", "cost": {}}
            store.keep({"key": key_of(request, len(rows)), "values": json.loads(json.dumps(row, default=float)), **of})
        rows.append(row)
        if out is not None:
            write_table(pd.DataFrame(rows), out)
        tick(rows[-1])
    if out is not None:  # also where all states were there
        write_table(pd.DataFrame(rows), out)
    return pd.DataFrame(rows)


def _begun(store: Store, request: str) -> list[dict]:
    """Rows of a life that was begun, up to the first that lacks."""
    keys = [key_of(request, k) for k in range(MOST_STEPS + 1)]
    found = store.read(keys)
    return [found[key]["values"] for key in takewhile(found.__contains__, keys)]


def _valid(values: dict, size: int) -> bool:
    """Whether values are those of a state: finite depths and rates, a distance, the next step, shares."""
    arrays = [values.get(name) for name in ("depths", "rates")]
    numbers = [values.get(name) for name in ("distance_km", "next_m")]
    return (
        all(isinstance(part, list) and len(part) == size for part in arrays)
        and all(isinstance(x, float) and isfinite(x) for x in [*numbers, *chain(*arrays)])
        and all(isinstance(values.get(name), float) for name in SHARES)
        and values["distance_km"] >= 0 < values["next_m"]
        and isinstance(values.get("end"), str)
    )


def _rows(worn: Worn, until: Until, limits: Limits, rows: list[dict]) -> Iterator[dict]:
    """Rows from the first one or from those that are there; the list grows with what is yielded."""
    d, (entry, goal) = worn.depths, worn.goal(until)
    scale = np.full(d.size, limits.depth)
    scale[d.ring], scale[d.distance] = limits.ring, np.inf
    walk = Walk(worn, scale, np.full(len(SHARES), limits.share), limits.error)

    def row(length: float, end: str) -> dict:
        """The present state; rates without work of friction end the life."""
        if not found.rate[: d.distance].any():
            end = end or "nothing wears: there is no work of friction"
        elif not found.rate[entry]:
            end = end or "the links no longer touch the ring"
        known = {"distance_km": float(y[d.distance]) / 1e3} | dict(found.known)
        return known | {"depths": y.tolist(), "rates": found.rate.tolist(), "next_m": length, "end": end}

    if rows:
        y, length = np.array(rows[-1]["depths"]), rows[-1]["next_m"]
        found = Found(np.array(rows[-1]["rates"]), np.array([rows[-1][name] for name in SHARES]))
    else:
        y = np.zeros(d.size)
        found = walk.look(y)
        length = walk.longest(found)
        yield row(length, "")
    while not rows[-1]["end"]:
        # a tenth beyond the bound, so that the step that reaches it is the last one
        requested = min(length, 1.1 * (goal - y[entry]) / found.rate[entry])
        try:
            taken, new, there, ahead = walk.step(y, found, requested)
        except (InputError, DivergenceError) as error:
            yield rows[-1] | {"end": f"left the model: {' '.join(str(error).split())}"}
            return
        end = f"more than {MOST_STEPS} steps" if len(rows) >= MOST_STEPS else ""
        if new[entry] >= goal:
            at = crossing(goal - y[entry], found.rate[entry], ahead.rate[entry], taken)
            taken, bend = (taken if at is None else at), (ahead.rate - found.rate) / (2 * taken)
            new, end = y + taken * found.rate + taken**2 * bend, f"reached {until.what} {until.value:g} m"
            there = walk.look(new)
        # not more than twice the step before; the shares ask for short steps where they change
        y, found, length = new, there, min(walk.longest(there), 2.0 * taken)
        yield row(length, end)
