"""The loop in Exudyn, an independent multibody code: its bodies, joints, equations and solver.

Bodies have absolute coordinates, joints are constraints with multipliers, the solver is generalized-alpha. The contacts
are one user-defined force (``peers.contact``), because Exudyn's own elements have other laws.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError, required
from trackdyn.jit import direct
from trackdyn.model.arrays import State
from trackdyn.model.constants import Chain, Drive, Model
from trackdyn.scene.scene import Scene
from trackdyn_replication.peers.contact import Contacts, Memory, force_vector, jacobian_triplets, peer_contact_loads
from trackdyn_replication.study.settings import PEER_LAWS

# Newton's iteration ends when the residual has fallen by the first or below the second: Exudyn's own defaults.
RELATIVE_TOLERANCE = 1e-8
ABSOLUTE_TOLERANCE = 1e-10
SPECTRAL_RADIUS = 0.9  # parameter of the generalized-alpha method: below 1 it damps unresolved frequencies


def require_exudyn():
    """Import and return the module ``exudyn``."""
    sys.exudynFast = True  # its build without range checks, where there is one
    return required("exudyn")


@dataclass(frozen=True)
class PeerRun:
    """Motion and computing time of a run of the independent code."""

    time: np.ndarray  # (s,) times of the samples, s; the first is 0
    centre: np.ndarray  # (s, n, 2) mass centres, m
    angle: np.ndarray  # (s, n) angles of the bodies, rad
    gap: np.ndarray  # (s,) largest distance between the two pins of any joint, m
    wall: float  # computing time of the integration, s
    cpu: float


def free_wheels(scene: Scene, model: Model) -> np.ndarray:
    """Return inertia (kg m2) and bearing drag (N m s/rad) of the wheels other than the sprocket, (w - 1, 2)."""
    laws = {name: getattr(scene, name) for name in PEER_LAWS}
    other = len(model.suspensions.wheel) or model.space is not None or scene.chain != "double_pin" or scene.load
    if other or laws != PEER_LAWS:
        raise InputError(
            "the loop in Exudyn has wheels without arms or sliders, viscous drag and bushings, "
            "and double pins in the plane; chain = double_pin, tension = locked, space = planar, drag = viscous, "
            "bushing_law = viscous, load = 0 is accepted"
        )
    return np.column_stack([model.wheels.inertia, model.wheels.drag])[1:]


def drive_at(drive: Drive, t: float) -> tuple[float, float]:
    """Return rotation (rad) and angular velocity (rad/s) of the sprocket at time ``t``: a cubic ramp, then constant."""
    x = min(t / drive.ramp, 1.0)
    return drive.rate * (drive.ramp * x**3 * (1 - x / 2) + max(t - drive.ramp, 0.0)), drive.rate * x * x * (3 - 2 * x)


def coordinates(chain: Chain, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 3) coordinates (mass centre, m, and angle, rad) of the bodies in a state, and their (n, 3) rates."""
    c, s, w = np.cos(state.angle), np.sin(state.angle), state.rate[:, None]
    step = chain.length[:, None] * np.column_stack([c, s])
    x, y = chain.com_x, chain.com_y
    arm = np.column_stack([x * c - y * s, x * s + y * c])
    left = [[0.0, 1.0], [-1.0, 0.0]]  # times a row: the row turned by 90 degrees
    centre, speed = (
        start + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)[:-1]]) + arms
        for start, steps, arms in ((state.pin[:2], step, arm), (state.pin[2:], w * step @ left, w * arm @ left))
    )
    return np.column_stack([centre, state.angle]), np.column_stack([speed, state.rate])


def run_exudyn_loop(
    model: Model, state: State, duration: float, step: float, sample: float, contacts: Contacts, wheels: np.ndarray,
    watch: Callable | None = None,
) -> PeerRun:  # fmt: skip
    """Integrate the closed chain with Exudyn from a state; the ``sample`` is a multiple of the ``step``."""
    exu = require_exudyn()
    chain, start = model.chain, coordinates(model.chain, state)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = _add_bodies(mbs, chain, *start, wheels)
    after_step, memory = _add_contacts(exu, mbs, nodes, model, state, contacts)
    positions = np.zeros((round(duration / sample) + 1, *start[0].shape))
    positions[0] = start[0]
    recorded = 1

    def at_end_of_step(mbs, t):
        nonlocal recorded
        q, v = (np.array(rows) for rows in (mbs.systemData.GetODE2Coordinates(), mbs.systemData.GetODE2Coordinates_t()))
        after_step(t, q, v)
        if watch is not None:
            watch(t, q, v, memory)
        if recorded < len(positions) and t > recorded * sample - 1e-9:
            # where Newton's iteration fails Exudyn takes a shorter step, and later ones do not end at the samples
            beyond = t - recorded * sample
            moved = q - beyond * v if beyond > 1e-9 else q
            positions[recorded] = moved[: start[0].size].reshape(start[0].shape)
            recorded += 1
        return True

    mbs.SetPostStepUserFunction(at_end_of_step)
    mbs.Assemble()
    wall, cpu = _solve(exu, mbs, duration, step)
    centre, angle = positions[:, :, :2].copy(), positions[:, :, 2].copy()
    c, s = np.cos(angle), np.sin(angle)
    first, second = (  # pins of every body
        centre + np.stack([x * c + chain.com_y * s, x * s - chain.com_y * c], axis=2)
        for x in (-chain.com_x, chain.length - chain.com_x)
    )
    gap = np.hypot(*(np.roll(first, -1, axis=1) - second).transpose(2, 0, 1)).max(axis=1)
    return PeerRun(np.arange(len(positions)) * sample, centre, angle, gap, wall, cpu)


def _add_bodies(mbs, chain: Chain, q: np.ndarray, v: np.ndarray, wheels: np.ndarray) -> list:
    """Add the chain at (n, 3) coordinates with their rates, joints and bushings, and free wheels; return the nodes."""
    import exudyn.itemInterface as items

    nodes, bodies, angles = [], [], []
    for i in range(len(q)):
        nodes.append(mbs.AddNode(items.NodeRigidBody2D(initialCoordinates=list(q[i]), initialVelocities=list(v[i]))))
        weight = {"mass": float(chain.mass[i]), "inertia": float(chain.inertia[i])}
        bodies.append(mbs.AddObject(items.ObjectRigidBody2D(nodeNumber=nodes[-1], **weight)))
        centre = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=bodies[-1]))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=centre, loadVector=[0.0, -chain.gravity, 0.0]))
        angles.append(mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=2)))

    def pin(i, side):
        position = [side * chain.length[i] - chain.com_x[i], -chain.com_y[i], 0.0]
        return mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=bodies[i], localPosition=position))

    bushing = {"stiffness": chain.stiffness, "damping": chain.damping}
    for i in range(len(q)):
        k = (i + 1) % len(q)
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[pin(i, 1), pin(k, 0)]))
        free_angle = chain.free_angle + (2 * pi if k == 0 else 0.0)  # angles fall by one turn along the loop
        spring = {"markerNumbers": [angles[i], angles[k]], "offset": free_angle} | bushing
        mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(**spring))
    ground = mbs.AddNode(items.NodePointGround())
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    at_rest = {"referenceCoordinates": [0.0], "initialCoordinates": [0.0], "initialVelocities": [0.0]}
    for inertia, drag in wheels.tolist():
        nodes.append(mbs.AddNode(items.Node1D(**at_rest)))
        mbs.AddObject(items.ObjectRotationalMass1D(inertia=inertia, nodeNumber=nodes[-1]))
        wheel = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=0))
        bearing = {"markerNumbers": [fixed, wheel], "stiffness": 0.0, "damping": drag}
        mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(**bearing))
    return nodes


def _solve(exu, mbs, duration: float, step: float) -> tuple[float, float]:
    """Run the solver; return wall and CPU seconds. Raises `DivergenceError`: it does not reach the end."""
    settings = exu.SimulationSettings()
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    settings.parallel.numberOfThreads = 1
    settings.solution.file.write = False
    t = settings.timeIntegration
    t.endTime, t.numberOfSteps, t.verboseMode = duration, round(duration / step), 0
    t.newton.relativeTolerance, t.newton.absoluteTolerance = RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE
    t.newton.useModifiedNewton = True
    t.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
    t.generalizedAlpha.computeInitialAccelerations = True
    t.adaptiveStepRecoverySteps = 0
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        reached = mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    except Exception as error:
        raise DivergenceError(f"exudyn: {str(error).strip().splitlines()[0]}") from None
    if reached is False:
        raise DivergenceError(f"exudyn: its solver gave up with a step of {step:g} s")
    return time.perf_counter() - wall, time.process_time() - cpu


def _add_contacts(exu, mbs, nodes: list, model: Model, state: State, contacts: Contacts) -> tuple[Callable, Memory]:
    """Add one object with all contact forces; return the function that updates their memory after a step, and that."""
    import exudyn.itemInterface as items

    length, begin, n = model.chain.length, float(state.wheel_angle[0]), len(model.chain.length)
    count = len(contacts.circle)
    size = 3 * n + count - 1
    memory = Memory(state.tooth_impact.copy(), state.wheel_impact.copy())
    load, torque, force = np.zeros((n, 3)), np.zeros((n, count)), np.zeros(size)
    loads, torques = np.zeros((2, n, 3)), np.zeros((2, n, count))
    triplets = np.zeros(((5 + count) * n * (2 + count), 3))

    def sparse(rows):
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(rows, size, size, useDenseMatrix=False)
        return matrix

    def sprocket(t):
        turned, spin = drive_at(model.drive, t)
        return begin + turned, spin

    q = np.zeros(size)
    write_forces = direct(force_vector, contacts, length, q, q, 0.0, 0.0, memory, load, torque, force)

    def forces(mbs, t, item, q, v):
        angle, spin = sprocket(t)
        write_forces(contacts, length, np.array(q), np.array(v), angle, spin, memory, load, torque, force)
        return force

    def jacobian(mbs, t, item, q, v, by_q, by_v):
        angle, spin = sprocket(t)
        q, v = np.array(q), np.array(v)
        arguments = contacts, length, q, v, angle, spin, memory, by_q, by_v, loads, torques, triplets
        return sparse(triplets[: jacobian_triplets(*arguments)])

    # the bodies carry the masses; matrices are asked for all the same
    names = ("massMatrix", "stiffnessMatrix", "dampingMatrix")
    matrices = {name: sparse(np.array([[0.0, 0.0, 1e-30]])) for name in names}
    functions = {"forceUserFunction": forces, "jacobianUserFunction": jacobian}
    mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=nodes, **matrices, **functions))

    def after_step(t, q, v):
        angle, spin = sprocket(t)
        peer_contact_loads(contacts, length, q, v, angle, spin, memory, True, load, torque)

    return after_step, memory
