"""The life of a rig: what wears, step by step, until a bound is reached or the worn rig leaves the model.

The depths of a worn rig (`law.Depths`) are the state, the distance that the chain ran (m) is the time, and the rate at
a state is a whole simulation: the worn rig settled, run until its contacts are steady, and its work of friction
distributed. Heun's method takes steps of a length that the change they make allows: in depth, in the shares of contact,
and in what the two rates of a step differ by.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from laboratory.wear.contour import contours, worn_rig
from laboratory.wear.law import AREAS, Coefficients, Depths, distribute
from trackdyn.errors import DivergenceError, InputError
from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.stopping import check_driven, run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.simulation.loop import Loop

# one turn of the sprocket; rates and forces of worn rigs scatter by some per cent, and a step of the wear spans several
RULE = StopRule(share_pct=0.5, force=0.03, passages=13, longest_turns=2)
FOLLOW = 2.5e-4  # m by which the arcs may miss a worn flank where it is worn
SMALLEST = 1 / 256  # of the step that a change asks for: what changes more within it is a jump, and is stepped over
MOST_STEPS = 400
# change that one step may make: of the ring's radius and of any other depth (m), of a share (points of a turn); and the
# difference of the rates at the two ends of a step, relative to that change
RING_STEP, DEPTH_STEP, SHARE_STEP, ERROR = 1e-3, 3e-4, 12.0, 0.2
SHARES = ("left_share_pct", "right_share_pct", "ring_share_pct")
SUMMARY = (*SHARES, *(f"{side}_{name}" for side in ("left", "right", "ring") for name in ("rms_n", "peak_n")))
SENSED = ("rms", "sd", "line")


class Rates(NamedTuple):
    """At a state: wear for each unit of distance, what the step watches beside the depths, and columns of the table."""

    rate: np.ndarray
    watched: np.ndarray
    known: Mapping[str, Any] = MappingProxyType({})


@dataclass
class Walk:
    """Heun's method with steps that the change within them controls."""

    rates: Callable[[np.ndarray], Rates]  # of a state; `InputError` or `DivergenceError` where there is none
    scale: np.ndarray  # change of each entry that one step may make
    watch: np.ndarray  # the same of what is watched
    error: float = ERROR  # difference of the two ends of a step, relative to the largest change that it may make

    def longest(self, now: Rates) -> float:
        """Distance in which the rates of a state make the largest change that a step may make; infinite at rest."""
        speed = float((np.abs(now.rate) / self.scale).max(initial=0.0))
        return 1.0 / speed if speed else float("inf")

    def step(self, y: np.ndarray, now: Rates, length: float) -> tuple[float, np.ndarray, Rates, Rates]:
        """One step of at most ``length``: its length, the new state, its rates, and those at its prediction."""
        least = SMALLEST * self.longest(now)
        while True:
            try:
                ahead = self.rates(y + length * now.rate)
                change = length * np.abs(ahead.rate - now.rate) / 2 / self.scale
                wrong = max(
                    float(change.max(initial=0.0)) / self.error,
                    float((np.abs(ahead.watched - now.watched) / self.watch).max(initial=0.0)),
                )
                if wrong <= 1.0 or length <= least:
                    new = y + length * (now.rate + ahead.rate) / 2
                    return length, new, self.rates(new), ahead
            except (InputError, DivergenceError):
                if length <= least:
                    raise
                wrong = 4.0
            length = max(length * max(0.9 / wrong, 0.25), least)


def crossing(goal: float, rate: float, ahead: float, length: float) -> float:
    """Where within a step of Heun's method a change reaches ``goal``; its end if it does not.

    The change is ``s rate + s^2 (ahead - rate) / (2 length)``.
    """
    roots = np.roots([(ahead - rate) / (2 * length), rate, -goal])
    return float(min((s.real for s in roots if abs(s.imag) < 1e-12 * length and 0 <= s.real <= length), default=length))


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

    def __call__(self, y: np.ndarray) -> Rates:
        d = self.depths
        rig, missed = worn_rig(self.rig, d.contours, [y[f] for f in d.flanks], y[d.arcs], float(y[d.bushing]))
        if missed > FOLLOW:
            raise InputError(f"the arcs miss the worn flank by {1e3 * missed:.2g} mm, more than {1e3 * FOLLOW:g} mm")
        radius = None if self.rig.ring_radius is None else self.rig.ring_radius - float(y[d.ring])
        steady = steady_fields(rig, self.rpm, self.rule)
        scene = Scene(rig, self.rpm, radius, sliding=True, every_link=True, **steady, **self.fields)
        check_driven(scene)
        if scene.fidelity["space"].setting == "spatial":
            raise InputError("scene: space = 'spatial': wear needs wheels in the plane of the chain")
        if len(scene.model.tooth.radius) != AREAS:
            raise InputError(f"tooth_contact = {scene.tooth_contact!r}: wear needs ten arcs")
        if abs(round(1.0 / scene.step) * scene.step - 1.0) > 1e-9:
            raise InputError(f"step = {scene.step!r} s: wear needs a whole number of steps a second, as 1e-4")
        loop = Loop(scene)
        if scene.tension == "locked":  # the wheel stays where the new chain put it
            if self._shift is None:
                new = loop if not y.any() else Loop(Scene(self.rig, self.rpm, **self.fields))
                self._shift = float(new.layout["tensioner_shift_m"])
            loop.shift_tensioner(self._shift)
        recording, converged = run_steady(loop, self.rule)
        worked = distribute(loop, [c.worn(y[f]) for c, f in zip(d.contours, d.flanks, strict=True)])
        summary, links = meshing_summary(recording), whole_loop(recording)
        per_km = 1e3 / worked.distance
        known = {name: summary[name] for name in SUMMARY} | {
            "ring_radius_m": float("nan") if radius is None else radius, "longer_pitch_m": 2 * float(y[d.bushing]),
            "left_depth_m": float(y[d.flanks[0]].max()), "right_depth_m": float(y[d.flanks[1]].max()),
            "arc_depth_m": float(y[d.arcs].max()), "misfit_m": missed, "steady": converged,
            "work_teeth_j_km": float(worked.areas.sum()) * per_km, "work_ring_j_km": worked.ring * per_km,
            "work_bushings_j_km": worked.bushing * per_km,
        }  # fmt: skip
        for name in SENSED:
            known |= {f"{name}_g": links[name].value, f"{name}_half_width_g": links[name].half_width}
        return Rates(d.rates(rig, radius, worked, self.coefficients), np.array([known[name] for name in SHARES]), known)

    def goal(self, radius: float | None, distance: float) -> tuple[int, float, str]:
        """Return the entry of the state that reaches a bound, its value there (m), and the bound in words."""
        if radius is None:
            if not distance > 0:
                raise InputError(f"until_distance = {distance:g} m: must be above 0")
            return self.depths.distance, distance, f"distance {distance:g} m"
        if self.rig.ring_radius is None:
            raise InputError(f"until_radius = {radius:g} m: the rig has no ring; give until_distance")
        if (loss := self.rig.ring_radius - radius) > 0:
            return self.depths.ring, loss, f"ring {radius:g} m"
        raise InputError(f"until_radius = {radius:g} m: must be below the new ring's, {self.rig.ring_radius:g} m")


def live(
    worn: Worn,
    until_radius: float | None = None,
    until_distance: float = float("inf"),
    tick: Callable[[dict], object] = lambda row: None,
) -> pd.DataFrame:
    """Compute the wear of a rig over its life, one row per state.

    Parameters
    ----------
    worn : Worn
        Rates of wear of the rig.
    until_radius, until_distance : float
        Radius of the ring, m, at which the life ends, or, without one, the distance that the chain ran, m.
    tick : function
        Called with every row.

    Returns
    -------
    DataFrame
        ``distance_km``, what has worn, shares, forces, RMS, SD and dominant peak of all links; ``depths`` (m), and
        ``end``: why the last row is the last one.

    Raises
    ------
    InputError
        The new rig cannot run, or the bound lies behind it.
    """
    d, (entry, goal, bound) = worn.depths, worn.goal(until_radius, until_distance)
    scale = np.full(d.size, DEPTH_STEP)
    scale[d.ring], scale[d.distance] = RING_STEP, np.inf
    walk = Walk(worn, scale, np.full(len(SHARES), SHARE_STEP))
    y, taken, end, rows = np.zeros(d.size), float("inf"), "", []
    now = worn(y)
    while True:
        if not now.rate[: d.distance].any():
            end = end or "nothing wears: there is no work of friction"
        elif not now.rate[entry]:
            end = end or "the links no longer touch the ring"
        elif len(rows) > MOST_STEPS:
            end = end or f"more than {MOST_STEPS} steps"
        if not end:
            # not more than twice the step before, as the shares ask for short steps where they change, and a tenth
            # beyond the bound, so that the step that reaches it is the last one
            longest = min(walk.longest(now), 2.0 * taken, 1.1 * (goal - y[entry]) / now.rate[entry])
            try:
                taken, new, there, ahead = walk.step(y, now, longest)
            except (InputError, DivergenceError) as error:
                end = f"left the model: {' '.join(str(error).split())}"
        rows.append({"distance_km": float(y[d.distance]) / 1e3} | dict(now.known) | {"depths": y.tolist(), "end": end})
        tick(rows[-1])
        if end:
            return pd.DataFrame(rows)
        if new[entry] >= goal:
            bend = (ahead.rate - now.rate) / (2 * taken)
            taken = crossing(goal - y[entry], now.rate[entry], ahead.rate[entry], taken)
            new, end = y + taken * now.rate + taken**2 * bend, f"reached {bound}"
            there = worn(new)
        y, now = new, there
