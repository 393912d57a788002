"""All solvers of the closed chain give the same accelerations, loads and projection of the closure."""

import numpy as np
import pytest

from replication.study.extremes import reference
from replication.study.extremes.solvers import Pose, posed
from trackdyn.chain import multipliers, riccati, transfer_matrices
from trackdyn.model.constants import Chain

SOLVERS = ["riccati", "multipliers", "product"]  # against the multipliers in extended precision
KERNELS = dict(zip(SOLVERS, (riccati, multipliers, transfer_matrices), strict=True))
# The sweep and the dense system stay below 1e-14 at 70 bodies.
AGREEMENT = 1e-10
# The product loses digits with its length (`trackdyn.chain.transfer_matrices.growth`), to how many differs by the
# processor's rounding: over 200 states at six bodies of the track 1e-11 in the middle and 1e-10 at most.
PRODUCT_AGREEMENT = 3e-9

TRACK = np.array([[0.1, 10.0, 0.012], [0.058, 2.5, 0.003]])
BAR = np.array([[0.1, 8.0, 8.0 * 0.1**2 / 12.0], [0.08, 5.0, 5.0 * 0.08**2 / 12.0]])


def make_chain(kind, n):
    """``n`` bodies (length, mass, inertia), two kinds by turns."""
    length, mass, inertia = np.ascontiguousarray(kind[np.arange(n) % 2].T)
    return Chain(length, mass, inertia, 0.5 * length, np.zeros(n), 130.0, 10.0, -2.0 * np.pi / n, 9.81)


def make_irregular(n, rng):
    """``n`` bodies that differ, with mass centres off their pin line; some radii of gyration reach the pins."""
    length, mass = rng.uniform(0.05, 0.12, n), rng.uniform(1.0, 15.0, n)
    com_x, com_y = length * rng.uniform(0.3, 0.7, n), rng.uniform(-0.02, 0.02, n)
    inertia = mass * (length * rng.uniform(0.25, 0.55, n)) ** 2
    return Chain(length, mass, inertia, com_x, com_y, 130.0, 10.0, -2.0 * np.pi / n, 9.81)


def close_polygon(length, rng):
    """Angles of a random polygon with these sides, clockwise: they fall by one turn along the chain.

    Exterior angles are drawn, then all are changed as little as closes the polygon.
    """
    n = len(length)
    exterior = rng.uniform(0.8, 1.2, n)
    angle = rng.uniform(0, 2.0 * np.pi) - 2.0 * np.pi * np.cumsum(exterior) / exterior.sum()
    for _ in range(20):  # Newton
        gap = np.array([length @ np.cos(angle), length @ np.sin(angle)])
        rows = length * np.array([-np.sin(angle), np.cos(angle)])
        angle -= rows.T @ np.linalg.solve(rows @ rows.T, gap)
    assert np.hypot(*gap) < 1e-14 * n
    turn = np.append(np.diff(angle), angle[0] - angle[-1] - 2.0 * np.pi)
    assert (np.abs(turn) < np.pi).all(), "no joint is folded over: the loop is one turn, clockwise"
    return angle


def random_state(chain, seed):
    """Angles, rates that keep the polygon closed, and wrenches at the mass centres."""
    rng = np.random.default_rng(seed)
    n = len(chain.length)
    angle = close_polygon(chain.length, rng)
    rows = gap_rows(chain, angle)
    rate = rng.normal(0.0, 4.0, n)
    rate -= rows.T @ np.linalg.solve(rows @ rows.T, rows @ rate)
    return angle, rate, rng.normal(0.0, 2000.0, n), rng.normal(0.0, 2000.0, n), rng.normal(0.0, 60.0, n)


def gap_rows(chain, angle):
    """(2, n) derivative of the gap at the cut by the angles, m."""
    return chain.length * np.array([-np.sin(angle), np.cos(angle)])


def solve(solver, chain, angle, rate, *loads, step=0.0, probe=0):
    """What a solver writes at this state and what it returns."""
    turn = np.append(np.diff(angle), angle[0] - angle[-1] - 2.0 * np.pi)
    relative = np.append(np.diff(rate), rate[0] - rate[-1])
    torque = -chain.stiffness * (turn - chain.free_angle) - chain.damping * relative
    state, work = posed(Pose(angle, rate, *loads, torque))
    for array in work.sweep:
        array[...] = 7.0  # of an earlier step
    assert step == 0.0 or solver != "product"
    return work.sweep, KERNELS[solver].accelerations(chain, state, work, step * chain.damping, probe)


def motion(solver, chain, angle, rate, *loads, step=0.0, probe=0):
    """Angular accelerations, then accelerations of the pins times 1 / length: all in rad/s2."""
    if solver == "reference":
        seen = reference.reference_accelerations(chain, angle, rate, *loads, implicit_step=step)
        alpha, first = seen.alpha, np.array([seen.pin_ax, seen.pin_ay])
        pins = [first]
        for i in range(len(angle)):
            side = chain.length[i] * np.array([np.cos(angle[i]), np.sin(angle[i])])
            pins.append(pins[-1] + alpha[i] * np.array([-side[1], side[0]]) - rate[i] ** 2 * side)
        base, probed, end = first, pins[probe], np.append(pins[-1], alpha[-1])
    else:
        work, _ = solve(solver, chain, angle, rate, *loads, step=step, probe=probe)
        alpha, base, probed, end = (array @ work.load for array in (work.response, work.base, work.probe, work.end))
    size = chain.length.max()
    return np.concatenate([alpha, base / size, probed / size, end[:2] / size, end[2:]])


CASES = (
    [(TRACK, n, SOLVERS) for n in (4, 5, 6)]
    + [(TRACK, n, SOLVERS[:2]) for n in (7, 8, 70)]
    + [(BAR, n, SOLVERS) for n in (4, 5, 6, 7, 8)]
    + [(BAR, 70, SOLVERS[:2])]
    + [(None, n, SOLVERS[:2]) for n in (4, 5, 8, 70)]
)
ONE_BY_ONE = [
    pytest.param(
        solver, kind, n, id=f"{solver}-{'irregular' if kind is None else 'track' if kind is TRACK else 'bar'}-{n}"
    )
    for kind, n, solvers in CASES
    for solver in solvers
]


def agreement(solver):
    """How far a solver may be from the multipliers, relative."""
    return PRODUCT_AGREEMENT if solver == "product" else AGREEMENT


@pytest.mark.parametrize(("solver", "kind", "n"), ONE_BY_ONE)
def test_solvers_agree(solver, kind, n):
    for seed in range(4):
        chain = make_irregular(n, np.random.default_rng(seed)) if kind is None else make_chain(kind, n)
        state = random_state(chain, seed)
        for step in (0.0,) if solver == "product" else (0.0, 1e-4, 5e-3):
            for probe in (0, n - 2):
                expected = motion("reference", chain, *state, step=step, probe=probe)
                seen = motion(solver, chain, *state, step=step, probe=probe)
                np.testing.assert_allclose(
                    seen / np.abs(expected).max(), expected / np.abs(expected).max(), rtol=0, atol=agreement(solver)
                )


@pytest.mark.parametrize(("solver", "kind", "n"), ONE_BY_ONE)
def test_solvers_agree_on_the_load_through_the_cut(solver, kind, n):
    for seed in range(4):
        chain = make_irregular(n, np.random.default_rng(seed)) if kind is None else make_chain(kind, n)
        state = random_state(chain, seed)
        expected = reference.reference_accelerations(chain, *state).pin_force
        work, returned = solve(solver, chain, *state)
        seen = work.load[:2] if solver == "riccati" else returned[3:5] if solver == "product" else returned
        if solver == "product":
            np.testing.assert_array_equal(returned[[0, 1, 5]], 0.0)
        # forces of a chain of ten-kilogram bodies under two-kilonewton loads
        np.testing.assert_allclose(seen, expected[-1], rtol=0, atol=agreement(solver) * np.abs(expected).max())


@pytest.mark.parametrize(("solver", "kind", "n"), ONE_BY_ONE)
def test_projection_closes_the_gap_with_the_least_change_of_energy(solver, kind, n):
    """Unit gaps: what the time loop makes of columns 0 to 2 and ``inverse`` (`advance`)."""
    step = 0.0 if solver == "product" else 5e-3
    chain = make_irregular(n, np.random.default_rng(1)) if kind is None else make_chain(kind, n)
    angle, *others = random_state(chain, 1)
    work, _ = solve(solver, chain, angle, *others, step=step, probe=2)
    alpha, base, probe, end = (
        array[:, :3] @ work.inverse[:, :2] for array in (work.response, work.base, work.probe, work.end)
    )
    size = np.abs(alpha).max() * chain.length.max()
    np.testing.assert_allclose(gap_rows(chain, angle) @ alpha, np.eye(2), rtol=0, atol=agreement(solver) * size)
    np.testing.assert_allclose(end[:2] - base, np.eye(2), rtol=0, atol=agreement(solver) * size)

    # The change has no component, weighted by mass, along any motion that keeps the gap. As a matrix over
    # pin and angles, mass is what the kinetic energy of the mass centres says; implicit damping adds to it.
    n = len(angle)
    c, s = np.cos(angle), np.sin(angle)
    side = chain.length * np.array([-s, c])
    centre = np.array([-(chain.com_x * s + chain.com_y * c), chain.com_x * c - chain.com_y * s])
    mass = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows = np.zeros((2, n + 2))
        rows[:, :2] = np.eye(2)
        rows[:, 2 : 2 + i] = side[:, :i]
        rows[:, 2 + i] = centre[:, i]
        mass += chain.mass[i] * rows.T @ rows
        mass[2 + i, 2 + i] += chain.inertia[i]
        joint = np.zeros(n + 2)
        joint[2 + i], joint[2 + (i + 1) % n] = -1.0, 1.0
        mass += step * chain.damping * np.outer(joint, joint)
    closure = np.hstack([np.zeros((2, 2)), gap_rows(chain, angle)])
    kept = np.linalg.svd(closure)[2][2:]  # rows that span the motions of the closed chain
    change = np.vstack([base, alpha])
    flow = mass @ change
    np.testing.assert_allclose(kept @ flow, 0.0, atol=agreement(solver) * (np.abs(mass) @ np.abs(change)).max())

    # and the sweep's change is the same, at the probed pin and the end too
    sweep, _ = solve("riccati", chain, angle, *others, step=step, probe=2)
    for seen, array in ((alpha, sweep.response), (base, sweep.base), (probe, sweep.probe), (end, sweep.end)):
        expected = array[:, :3] @ sweep.inverse[:, :2]
        np.testing.assert_allclose(seen, expected, rtol=0, atol=agreement(solver) * np.abs(alpha).max())


@pytest.mark.parametrize("solver", SOLVERS[1:])
def test_load_is_one_column(solver):
    chain = make_chain(BAR, 6)
    work, _ = solve(solver, chain, *random_state(chain, 0))
    np.testing.assert_array_equal(work.load, [0.0, 0.0, 0.0, 1.0])
    np.testing.assert_array_equal(work.inverse, np.eye(3))
    for array in (work.response, work.base, work.probe, work.end):
        assert (array[:, 2] == 0.0).all()
