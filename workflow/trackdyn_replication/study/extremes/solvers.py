"""Extremes of the chain and of impacts: 3 to 5,000 pitches, light connectors, digits of both solvers, restitution."""

from collections.abc import Iterator
from contextlib import suppress
from itertools import product

import numpy as np

from trackdyn.chain import riccati
from trackdyn.contact.laws import force_and_slopes
from trackdyn.jit import kernel
from trackdyn.model.arrays import make_state, make_work
from trackdyn.model.constants import Chain
from trackdyn.rig.laws import delivered_restitution
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import build_chain, make_law
from trackdyn_replication.study.extremes import transfer_product
from trackdyn_replication.study.extremes.judge import COMPLETED, attempted, below, within_bounds

FAMILY = "length of the chain"
LONGEST_PRODUCT = 70  # bodies; its numbers overflow beyond a few hundred
SOLVERS = ("riccati", "transfer_product")
KINDS = ("link and connector", "uniform bars", "centres of percussion")
SEEDS = 3
EPS = float(np.finfo(float).eps)
# Digits of a solver that keeps all of them: rounding adds up over the bodies, and the acceleration of a
# body far away depends on all bodies between, so that the error may grow with their number squared.
LEAST_ERROR = 1e-12
GROWTH_TOLERANCE = 0.2  # of the logarithm of the growth a body: a loop is not a straight line


# a chain in motion: angles and rates, forces x and y and moments at the mass centres, bushing torques
Pose = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def make_chain(rig: Rig, kind: str, bodies: int) -> Chain:
    """Return a chain of an even number of ``bodies`` of one kind."""
    period = build_chain(rig)
    length, mass, inertia = (np.tile(a[:2], bodies // 2) for a in (period.length, period.mass, period.inertia))
    if kind == "uniform bars":
        length, mass = np.full(bodies, length[0]), np.full(bodies, mass[0])
        inertia = mass * length**2 / 12
    elif kind == "centres of percussion":
        inertia = mass * (length / 2) ** 2
    return period._replace(
        length=length, mass=mass, inertia=inertia, com_x=length / 2, com_y=np.zeros(bodies),
        free_angle=-2 * np.pi / bodies,
    )  # fmt: skip


def make_pose(chain: Chain, seed: int) -> Pose:
    """Return a random convex clockwise loop whose rates keep it closed, with kilonewtons at every body."""
    rng = np.random.default_rng(seed)
    n = len(chain.length)
    steps = rng.uniform(0.8, 1.2, n)
    angle = -2 * np.pi * np.cumsum(steps) / steps.sum()
    for _ in range(20):
        rows = chain.length * np.array([-np.sin(angle), np.cos(angle)])
        angle -= rows.T @ np.linalg.solve(rows @ rows.T, [chain.length @ np.cos(angle), chain.length @ np.sin(angle)])
    rows = chain.length * np.array([-np.sin(angle), np.cos(angle)])
    rate = rng.normal(0.0, 4.0, n)
    rate -= rows.T @ np.linalg.solve(rows @ rows.T, rows @ rate)
    joint = np.append(np.diff(angle), angle[0] - angle[-1] - 2 * np.pi)
    relative = np.append(np.diff(rate), rate[0] - rate[-1])
    torque = -chain.stiffness * (joint - chain.free_angle) - chain.damping * relative
    wrench = rng.normal(0.0, 1.0, (3, n)) * np.array([[2000.0], [2000.0], [60.0]])
    return angle, rate, *wrench, torque


def solve(solver: str, chain: Chain, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Return angular accelerations (rad/s2) and that of the first pin (m/s2) of a chain in a pose, by a solver."""
    if solver == "transfer_product":
        alpha, start = transfer_product.accelerations(chain, *pose)
        return alpha, start[:2]
    angle, rate, *loads = pose
    state, work = make_state(len(angle), 1, 1), make_work(len(angle), 1, 1)
    state.angle[:], state.rate[:] = angle, rate
    work.cos[:], work.sin[:] = np.cos(angle), np.sin(angle)
    for array, load in zip((work.force_x, work.force_y, work.moment, work.torque), loads, strict=True):
        array[:] = load
    riccati.accelerations(chain, state, work, 0.0)
    sweep = work.sweep
    return sweep.response @ sweep.load, sweep.base @ sweep.load


def newton_euler_residual(chain: Chain, pose: Pose, alpha, base) -> float:
    """Return the residual of the equations of motion over their largest term, in extended precision and O(n)."""
    long = np.longdouble
    angle, rate, fx, fy, moment, torque, alpha = (np.asarray(a, long) for a in (*pose, alpha))
    cos, sin = np.cos(angle), np.sin(angle)
    side = chain.length * np.array([cos, sin])
    arm = np.array([chain.com_x * cos - chain.com_y * sin, chain.com_x * sin + chain.com_y * cos])
    force = np.array([fx, fy - chain.mass * chain.gravity])

    def swing(r):
        return alpha * np.array([-r[1], r[0]]) - rate**2 * r

    def cross(a, b):
        return a[0] * b[1] - a[1] * b[0]

    pins = np.asarray(base, long)[:, None] + np.cumsum(np.column_stack([np.zeros(2, long), swing(side)]), axis=1)
    inertial = chain.mass * (pins[:, :-1] + swing(arm))
    # joint forces but for that through the cut, which is taken where Euler's equations fit best
    through = np.cumsum(np.column_stack([np.zeros(2, long), force - inertial]), axis=1)
    spin = chain.inertia * alpha - moment + torque - np.roll(torque, 1)
    spin += cross(arm, through[:, :-1]) + cross(side - arm, through[:, 1:])
    normal = side[::-1] * np.array([[-1], [1]])  # cross(side, cut force) as a product
    a, b, c = (normal[0] ** 2).sum(), (normal[0] * normal[1]).sum(), (normal[1] ** 2).sum()
    right = -normal @ spin
    cut = np.array([c * right[0] - b * right[1], a * right[1] - b * right[0]]) / (a * c - b * b)

    def share(left, *terms):
        return np.abs(left).max() / max(np.abs(term).max() for term in terms)

    euler = share(spin + cut @ normal, moment, chain.inertia * alpha, cross(side, through[:, 1:] + cut[:, None]))
    newton, closure = share(through[:, -1], force, inertial), share(pins[:, -1] - pins[:, 0], pins, swing(side))
    return float(max(euler, newton, closure))


def solver_error(solver: str, chain: Chain) -> float:
    """Return the median over poses of the sweep's residual, or of the literal product's difference from the sweep."""
    errors = np.full(SEEDS, np.inf)  # where numbers overflow or the system is singular no digit is left
    for seed in range(SEEDS):
        pose = make_pose(chain, seed)
        with suppress(np.linalg.LinAlgError):
            alpha, base = solve(solver, chain, pose)
            if not (np.isfinite(alpha).all() and np.isfinite(base).all()):
                continue
            if solver == "transfer_product":
                expected, _ = solve("riccati", chain, pose)
                errors[seed] = np.abs(alpha - expected).max() / np.abs(expected).max()
            else:
                errors[seed] = newton_euler_residual(chain, pose, alpha, base)
    return float(np.median(errors))


def digits(rig: Rig, bodies: list[int]) -> Iterator[dict]:
    """Yield rows of sweep and literal product on every kind of chain; the product of up to `LONGEST_PRODUCT`."""
    for kind in KINDS:
        for n in bodies:
            chain = make_chain(rig, kind, n)
            for solver in SOLVERS:
                if solver == "riccati" or n <= LONGEST_PRODUCT:
                    yield attempted(FAMILY, f"{solver}, {n} bodies, {kind}", _digits, solver, chain, kind)


def _digits(solver: str, chain: Chain, kind: str) -> dict:
    n = len(chain.length)
    marks = {"group": f"{solver}, {kind}", "at": n}
    if solver == "transfer_product":
        if kind != KINDS[2]:  # there the prediction is infinite but for rounding
            with np.errstate(over="ignore"):  # rounding times the growth along the chain
                marks |= {"expected": float(EPS * np.float64(transfer_product.growth(chain)) ** (n / 2))}
        return {"outcome": COMPLETED, "measure": "error", "value": solver_error(solver, chain)} | marks
    return below(solver_error(solver, chain), max(LEAST_ERROR, EPS * n**2), "residual", **marks)


def growth_rates(rig: Rig) -> Iterator[dict]:
    """Yield the growth of the literal product's error per body, for two kinds of chain."""
    for kind in KINDS[:2]:
        yield attempted(FAMILY, f"growth of the literal product, {kind}", _growth, rig, kind)


def _growth(rig: Rig, kind: str) -> dict:
    """Return columns of the growth between six bodies and the last number with a correct digit."""
    errors = {n: solver_error("transfer_product", make_chain(rig, kind, n)) for n in range(6, 30, 2)}
    sizes = [n for n, error in errors.items() if error < 1e-2]
    rate = np.exp(np.polyfit(sizes, np.log([errors[n] for n in sizes]), 1)[0])
    closed = transfer_product.growth(make_chain(rig, kind, 6)) ** 0.5
    value, expected = float(np.log10(rate)), float(np.log10(closed))
    return within_bounds(value, expected, GROWTH_TOLERANCE * expected, "digits lost a body")


def light_connectors(rig: Rig, ratios=(1, 10, 1e2, 1e3, 1e4, 1e5, 1e6)) -> Iterator[dict]:
    """Yield rows of the sweep with links up to a million times as heavy as connectors."""

    def light(ratio: float) -> dict:
        mass, inertia = rig.chain.link_mass / ratio, rig.chain.link_inertia / ratio
        chain = make_chain(rig.changed(chain__connector_mass=mass, chain__connector_inertia=inertia), KINDS[0], 70)
        bound = max(LEAST_ERROR, 10 * EPS * ratio * len(chain.length))  # as the condition of the equations grows
        return below(solver_error("riccati", chain), bound, "residual", group="riccati", at=ratio)

    for ratio in ratios:
        yield attempted("mass ratio", f"riccati, link to connector {ratio:g}, 70 bodies", light, ratio)


@kernel
def _rebound(law, mass, speed, radius, steps):
    """Return speed after over speed before an impact, by leapfrog steps of a ``steps``-th of a half period."""
    x, v = 0.0, speed
    h = np.sqrt(mass * radius**0.5 / (law.stiffness * (speed + 1e-9) ** 0.5)) / steps
    for _ in range(1000 * steps):
        x += 0.5 * h * v
        if x <= 0.0:
            break
        v -= h * force_and_slopes(law, x, v, speed, radius)[0] / mass
        x += 0.5 * h * v
        if x <= 0.0:
            break
    return -v / speed


def _impact(rig: Rig, law_name: str, value: float) -> dict:
    surface = rig.tooth_contact
    law = make_law(
        surface.contact_length, rig.composite_modulus(surface), value, 0.0, 0.0, 1.0, 1e-9, rig.impact.factor_limit,
        law_name,
    )  # fmt: skip
    expected = delivered_restitution(law.loss) if law_name == "printed" else value
    restitution = _rebound(law, rig.chain.link_mass, 0.5, 0.08, 4000)
    return within_bounds(restitution, expected, 2e-3, "restitution", group=law_name, at=value)


def restitution(
    rig: Rig, nominal=(0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)
) -> Iterator[dict]:
    """Yield the restitution of an impact against the nominal one, for both normal laws."""
    for law, value in product(("printed", "delivered"), nominal):
        yield attempted("restitution", f"one impact, {law}, {value:g}", _impact, rig, law, value)
