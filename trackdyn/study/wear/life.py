"""The life of a rig: what wears, step by step, until a bound is reached or the worn rig leaves the model.

The depths of a worn rig (`law.Depths`) are the state, the distance that the chain ran (m) is the time, and the rate at
a state is a whole simulation: the worn rig settled, run until its contacts are steady, and its work of friction
distributed. Heun's method takes steps of a length that the change they make allows: in depth, in the shares of contact,
and in what the two rates of a step differ by.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from trackdyn.errors import DivergenceError, InputError
from trackdyn.files import keep, refuse_unwritable
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.stopping import StopRule, refuse_undriven, run_steady, steady_fields
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.study.wear.contour import contours, worn_rig
from trackdyn.study.wear.law import Coefficients, Depths
from trackdyn.study.wear.work import distribute
from trackdyn.sweeps.row import row_sources
from trackdyn.sweeps.store import key_of
from trackdyn.sweeps.table import read_table, write_table

RULE = StopRule(share_pct=0.3, force=0.01, passages=13, longest_turns=4)
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

    ring: float = 8e-4
    depth: float = 1.5e-4
    share: float = 6.0
    error: float = 0.2

    def times(self, factor: float) -> "Limits":
        """Limits that give steps of ``factor`` times the length."""
        return Limits(self.ring * factor, self.depth * factor, self.share * factor, self.error)


class Until(NamedTuple):
    """Where a life ends: at a radius of the ring, a depth of a flank, a longer pitch (m), or a distance (m)."""

    what: str
    value: float


UNITS = {"ring": {"m": 1.0, "mm": 1e-3}, "tooth": {"m": 1.0, "mm": 1e-3}, "pitch": {"m": 1.0, "mm": 1e-3},
         "distance": {"m": 1.0, "km": 1e3}}  # fmt: skip


def parse_until(text: str) -> Until:
    """Read a bound such as ``ring 0.303 m``, ``tooth 1 mm``, ``pitch 2 mm`` or ``distance 5000 km``.

    Raises
    ------
    InputError
        It is none of these.
    """
    try:
        what, value, unit = str(text).split()
        return Until(what, float(value) * UNITS[what][unit]) if 0 < float(value) < 1e9 else _no_bound(text)
    except (ValueError, KeyError):
        return _no_bound(text)


def _no_bound(text: str) -> Until:
    raise InputError(
        f"until = {text!r} is not accepted: a bound such as 'ring 0.303 m', 'tooth 1 mm', 'pitch 2 mm' or "
        "'distance 5000 km' is needed"
    )


class Found(NamedTuple):
    """Rates at a state: what wears for each unit of distance, what is watched beside the depths, and what is told."""

    rate: np.ndarray
    watched: np.ndarray
    told: Mapping[str, Any] = MappingProxyType({})


@dataclass
class Walk:
    """Heun's method with steps that the change within them controls.

    Attributes
    ----------
    find : function
        State to `Found`; `InputError` or `DivergenceError` where there is none.
    scale : array
        Change of each entry that one step may make.
    watch : array
        The same of what is watched.
    error : float
        Difference of the two ends of a step, relative to the largest change that it may make.
    """

    find: Callable[[np.ndarray], Found]
    scale: np.ndarray
    watch: np.ndarray
    error: float = 0.2
    evaluations: int = field(default=0)

    def longest(self, found: Found) -> float:
        """Distance in which the rates of a state make the largest change that a step may make; infinite at rest."""
        speed = float((np.abs(found.rate) / self.scale).max(initial=0.0))
        return 1.0 / speed if speed else float("inf")

    def step(self, y: np.ndarray, found: Found, length: float) -> tuple[float, np.ndarray, Found, Found]:
        """One step of at most ``length``: the length taken, the new state, what is found there, and at its prediction.

        Raises
        ------
        InputError, DivergenceError
            There is nothing beyond this state, however short the step.
        """
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
    """The rates of a rig: a function of its depths.

    Attributes
    ----------
    rig : Rig
        As new.
    rpm : float
        Motor speed, rev/min.
    ring_radius : float or None
        Of the new ring, m.
    coefficients : Coefficients
    fields : dict
        Of the scene: tension, step, integrator and the like.
    rule : StopRule
        When a run is steady.
    """

    rig: Rig
    rpm: float
    ring_radius: float | None
    coefficients: Coefficients
    fields: dict
    rule: StopRule = RULE

    def __post_init__(self):
        self.depths = Depths(contours(self.rig.groove_profile))
        self._shift: float | None = None

    def worn(self, y: np.ndarray) -> tuple[Rig, float | None, float]:
        """The worn rig, the radius of its ring (m), and how far its arcs miss its flanks (m)."""
        d = self.depths
        rig, missed = worn_rig(self.rig, d.contours, [y[f] for f in d.flanks], y[d.arcs], float(y[d.bushing]))
        return rig, None if self.ring_radius is None else self.ring_radius - float(y[d.ring]), missed

    def __call__(self, y: np.ndarray) -> Found:
        rig, radius, missed = self.worn(y)
        if missed > FOLLOW:
            raise InputError(f"the arcs miss the worn flank by {1e3 * missed:.2g} mm, more than {1e3 * FOLLOW:g} mm")
        scene = Scene(
            rig, self.rpm, radius, sliding=True, every_link=True, **steady_fields(rig, self.rpm, self.rule),
            **self.fields,
        )  # fmt: skip
        refuse_undriven(scene)
        loop = Loop(scene)
        if scene.tension == "locked":  # the wheel stays where it was for the new chain
            self._shift = self._first_shift(loop, y)
            loop.shift_tensioner(self._shift)
        recording, steady = run_steady(loop, self.rule)
        of = self.depths.contours
        worked = distribute(loop, of, [c.worn(y[f]) for c, f in zip(of, self.depths.flanks, strict=True)])
        rate = self.depths.rates(rig, radius, worked, self.coefficients)
        summary, felt = meshing_summary(recording), whole_loop(recording)
        told = {name: summary[name] for name in SUMMARY} | {"steady": steady}
        for name in SENSED:
            told |= {f"{name}_g": felt[name].value, f"{name}_half_width_g": felt[name].half_width}
        per_km = 1e3 / worked.distance
        told |= {
            "work_teeth_j_km": float(worked.areas.sum()) * per_km, "work_ring_j_km": worked.ring * per_km,
            "work_bushings_j_km": worked.bushing * per_km, "misfit_m": missed,
        }  # fmt: skip
        return Found(rate, np.array([summary[name] for name in SHARES]), told)

    def _first_shift(self, loop: Loop, y: np.ndarray) -> float:
        if self._shift is not None:
            return self._shift
        if not y.any():
            return float(loop.layout["tensioner_shift_m"])
        new = Scene(self.rig, self.rpm, self.ring_radius, **self.fields)
        return float(Loop(new).layout["tensioner_shift_m"])

    def goal(self, until: Until, y: np.ndarray) -> tuple[float, int]:
        """What is left to a bound (m), and the entry of the state that reaches it (-1: distance)."""
        d = self.depths
        if until.what == "ring":
            if self.ring_radius is None:
                raise InputError("until = 'ring ...' is not accepted: the rig has no ring; another bound is needed")
            return self.ring_radius - until.value - float(y[d.ring]), d.ring
        if until.what == "pitch":
            return until.value / 2 - float(y[d.bushing]), d.bushing
        if until.what == "tooth":
            entry = d.flanks[0].start + int(np.argmax(y[d.flanks[0].start : d.flanks[1].stop]))
            return until.value - float(y[entry]), entry
        return float("inf"), -1

    def row(self, x: float, y: np.ndarray) -> dict[str, Any]:
        """What a state is in words of the rig."""
        d = self.depths
        radius = float("nan") if self.ring_radius is None else self.ring_radius - float(y[d.ring])
        left, right = (y[f] for f in d.flanks)
        return {
            "distance_km": x / 1e3, "ring_radius_m": radius, "left_depth_m": float(left.max()),
            "right_depth_m": float(right.max()), "arc_depth_m": float(y[d.arcs].max()),
            "longer_pitch_m": 2 * float(y[d.bushing]),
        }  # fmt: skip


def live(
    worn: Worn,
    until: Until,
    limits: Limits = Limits(),
    out: Path | str | None = None,
    overwrite: bool = False,
    tick: Callable[[dict], object] = lambda row: None,
) -> pd.DataFrame:
    """The life of a rig, a row a state.

    Parameters
    ----------
    out : path or None
        Table (.parquet) that is written after every step; the same call goes on from what is there.
    overwrite : bool
        Begin anew if the table holds another life.
    tick : function
        Called with every new row.

    Returns
    -------
    DataFrame
        ``distance_km``, what has worn, shares, forces and what a sensor feels; ``depths`` and ``rates`` (m, and m for
        each m that the chain runs), ``next_m``, ``request``, and ``end``: why the last row is the last one.

    Raises
    ------
    InputError
        The new rig cannot run, ``until`` lies behind it, or ``out`` holds another life.
    """
    request = key_of(
        row_sources("study/wear"), worn.rig.model_dump(), worn.rpm, worn.ring_radius, worn.coefficients.model_dump(),
        worn.fields, worn.rule.model_dump(), until, limits,
    )  # fmt: skip
    rows: list[dict] = []
    if out is not None:
        refuse_unwritable(out)
        keep(out)
        rows = _begun(Path(out), request, overwrite)
    for row in _rows(worn, until, limits, rows):
        if rows and row["distance_km"] == rows[-1]["distance_km"]:  # the same state, and why it is the last one
            rows.pop()
        rows.append(row | {"request": request})
        if out is not None:
            write_table(pd.DataFrame(rows), out)
        tick(rows[-1])
    return pd.DataFrame(rows)


def _begun(out: Path, request: str, overwrite: bool) -> list[dict]:
    """Rows of a life that was begun."""
    if not out.exists():
        return []
    table = read_table(out)
    if "request" in table.columns and set(table["request"]) == {request}:
        return table.to_dict("records")
    if overwrite:
        return []
    raise InputError(f"{out}: holds another life; give another name, or --overwrite to begin anew")


def _rows(worn: Worn, until: Until, limits: Limits, rows: list[dict]) -> Iterator[dict]:
    d = worn.depths
    scale = np.full(d.size, limits.depth)
    scale[d.ring] = limits.ring
    walk = Walk(worn, scale, np.full(len(SHARES), limits.share), limits.error)
    x, y = 0.0, np.zeros(d.size)
    if rows:
        x, y = 1e3 * rows[-1]["distance_km"], np.array(rows[-1]["depths"])
        if rows[-1]["end"]:
            return
        found = Found(np.array(rows[-1]["rates"]), np.array([rows[-1][name] for name in SHARES]))
        length = rows[-1]["next_m"]
    else:
        if worn.goal(until, y)[0] <= 0:
            raise InputError(f"until = {until.what} {until.value:g} m is behind the new rig; a bound ahead is needed")
        found = walk.look(y)
        length = walk.longest(found)
        yield _row(worn, x, y, found, length, _still(worn, found, until))
        if _still(worn, found, until):
            return
    for _ in range(len(rows), MOST_STEPS):
        left, entry = worn.goal(until, y)
        speed = float(found.rate[entry]) if entry >= 0 else 1.0
        left = left if entry >= 0 else until.value - x
        # a tenth beyond a bound, so that the step that reaches it is the last one
        asked = min(length, (1.1 if entry >= 0 else 1.0) * left / speed) if speed > 0 else length
        try:
            taken, new, there, ahead = walk.step(y, found, asked)
        except (InputError, DivergenceError) as error:
            yield rows[-1] | {"end": f"left the model: {' '.join(str(error).split())}"}
            return
        at = _reached(worn, until, (x, y, new), (found, ahead), taken)
        end = ""
        if at is not None:
            new = y + at * found.rate + at**2 * (ahead.rate - found.rate) / (2 * taken)
            there, taken, end = walk.look(new), at, f"reached {until.what} {until.value:g} m"
        x, y, found = x + taken, new, there
        # not more than twice the step before; the shares ask for short steps where they change
        length = min(walk.longest(found), 2.0 * taken)
        end = end or _still(worn, found, until)
        yield _row(worn, x, y, found, length, end)
        if end:
            return


def _reached(worn: Worn, until: Until, states, rates: tuple[Found, Found], taken: float) -> float | None:
    """Where within a step from one state to another (m) the bound is reached, if it is."""
    x, y, new = states
    left, entry = worn.goal(until, new)
    if entry < 0:
        return taken if x + taken >= until.value * (1 - 1e-12) else None
    if left > 0:
        return None
    at = crossing(left + float(new[entry] - y[entry]), *(float(found.rate[entry]) for found in rates), taken)
    return taken if at is None else at


def _still(worn: Worn, found: Found, until: Until) -> str:
    """Why nothing more will happen; empty if something does."""
    if not found.rate.any():
        return "nothing wears: there is no work of friction"
    if until.what == "ring" and not found.rate[worn.depths.ring]:
        return "the links no longer touch the ring"
    return ""


def _row(worn: Worn, x: float, y: np.ndarray, found: Found, length: float, end: str) -> dict[str, Any]:
    told = {"depths": y.tolist(), "rates": found.rate.tolist(), "next_m": length, "end": end}
    return worn.row(x, y) | dict(found.told) | told
