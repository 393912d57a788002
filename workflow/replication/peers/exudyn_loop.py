"""The loop in Exudyn, an independent multibody code: its bodies, joints, equations and solver.

Bodies have three absolute coordinates each and joints are rigid constraints with multipliers (the chain
of the simulator has relative coordinates and no joint forces but one), the solver is Exudyn's implicit
generalized-alpha method. Bushings are Exudyn's spring-dampers, wheels its rotating masses. The contacts
are one user-defined force (``peers.contact``), because Exudyn's own elements have other laws.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from replication.peers.contact import Contacts, Memory, force_vector, jacobian_triplets, peer_contact_loads
from replication.study.settings import PEER_LAWS
from trackdyn.errors import DivergenceError, InputError
from trackdyn.extras import required
from trackdyn.model.constants import NO_MOTOR, Chain, Drive, Model
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene

# Newton's iteration ends when the residual has fallen by the first or below the second: Exudyn's own defaults.
RELATIVE_TOLERANCE = 1e-8
ABSOLUTE_TOLERANCE = 1e-10
SPECTRAL_RADIUS = 0.9  # parameter of the generalized-alpha method: below 1 it damps what the step does not resolve


def require_exudyn():
    """The module ``exudyn``."""
    sys.exudynFast = True  # its build without range checks, where there is one
    return required("exudyn")


@dataclass(frozen=True)
class PeerStart:
    """Where a run begins."""

    pin: np.ndarray  # (4,) position and velocity of the input pin of body 1, m and m/s
    angle: np.ndarray  # (n,) of the bodies, rad (falling by one turn along the loop)
    rate: np.ndarray  # (n,) of the bodies, rad/s
    sprocket_angle: float  # rad
    # initial impact velocities of the contacts that exist already, (n,) and (n / 2, w), m/s
    tooth_impact: np.ndarray
    wheel_impact: np.ndarray


def start_of(state) -> PeerStart:
    """Start of a run from a ``model.arrays.State``."""
    copied = {name: getattr(state, name).copy() for name in ("pin", "angle", "rate", "tooth_impact", "wheel_impact")}
    return PeerStart(**copied, sprocket_angle=float(state.wheel_angle[0]))


@dataclass(frozen=True)
class PeerWheels:
    """Wheels beside the sprocket: moments of inertia (kg m2), bearing drag (N m s/rad); they start at rest."""

    inertia: tuple[float, ...]
    drag: tuple[float, ...]


@dataclass(frozen=True)
class PeerRun:
    """Motion and computing time of a run of the independent code."""

    time: np.ndarray  # (s,) times of the samples, s; the first is 0
    centre: np.ndarray  # (s, n, 2) mass centres, m
    angle: np.ndarray  # (s, n) angles of the bodies, rad
    gap: np.ndarray  # (s,) largest distance between the two pins of any joint, m
    wall: float  # computing time of the integration, s
    cpu: float


def free_wheels(scene: Scene, model: Model) -> PeerWheels:
    """The wheels of a loop as its model has them; a loop that this code has not is refused."""
    plain = model.drive.motor == NO_MOTOR and scene.chain == "double_pin"
    laws = {name: getattr(scene, name) for name in PEER_LAWS}
    if len(model.carriers.wheel) or model.space is not None or not plain or laws != PEER_LAWS:
        raise InputError(
            "the loop in Exudyn has fixed wheels, a prescribed speed, viscous drag and bushings, and double pins in "
            "the plane; a rig from exudyn_loop.fixed with chain = double_pin, tension = locked, space = planar, "
            "drag = viscous, bushing_law = viscous is accepted"
        )
    return PeerWheels(tuple(map(float, model.wheels.inertia[1:])), tuple(map(float, model.wheels.drag[1:])))


def fixed(rig: Rig) -> Rig:
    """The rig as Exudyn has it: every wheel fixed where its file has it, and a prescribed speed."""
    changes = {
        f"{name}__{carrier}": None
        for name, wheel in rig.wheels.items()
        for carrier in ("arm", "slider")
        if getattr(wheel, carrier)
    }
    if changes or rig.drive:
        changes |= {"drive": None}
    return rig.changed(**changes, tension__kept="locked")


def drive_at(drive: Drive, t: float) -> tuple[float, float]:
    """Angle turned (rad) and angular velocity (rad/s) of the sprocket at time ``t``: a cubic ramp, then constant."""
    x = min(t / drive.ramp, 1.0)
    return drive.rate * (drive.ramp * x**3 * (1 - x / 2) + max(t - drive.ramp, 0.0)), drive.rate * x * x * (3 - 2 * x)


def coordinates(chain: Chain, start: PeerStart) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) coordinates (mass centre, angle) of a start and their (n, 3) rates."""
    c, s, w = np.cos(start.angle), np.sin(start.angle), start.rate
    step = chain.length[:, None] * np.column_stack([c, s])
    swings = chain.length[:, None] * np.column_stack([-s * w, c * w])
    pin = start.pin[:2] + np.vstack([np.zeros(2), np.cumsum(step, axis=0)[:-1]])
    speed = start.pin[2:] + np.vstack([np.zeros(2), np.cumsum(swings, axis=0)[:-1]])
    x, y = chain.com_x, chain.com_y
    arm = np.column_stack([x * c - y * s, x * s + y * c])
    swing = np.column_stack([-w * arm[:, 1], w * arm[:, 0]])
    return np.column_stack([pin + arm, start.angle]), np.column_stack([speed + swing, w])


def run_exudyn_loop(
    chain: Chain,
    start: PeerStart,
    duration: float,
    step: float,
    sample: float,
    contacts: Contacts,
    wheels: PeerWheels,
    drive: Drive,
    watch: Callable | None = None,
) -> PeerRun:
    """Integrate the closed chain with Exudyn.

    Parameters
    ----------
    chain : Chain
        Data of the bodies and bushings.
    start : Start
        Configuration and velocities.
    duration, step, sample : float
        Simulated time, time step and time between samples, s; the sample is a multiple of the step.
    contacts, wheels, drive
        Contacts with the wheels, the free wheels, and the sprocket's motion.
    watch : function, optional
        Called after every step with time (s), coordinates, their rates and the memory of the contacts.

    Raises
    ------
    InputError
        If Exudyn is not installed.
    DivergenceError
        If its solver does not reach the end.
    """
    exu = require_exudyn()
    import exudyn.itemInterface as items

    n = len(chain.length)
    q, v = coordinates(chain, start)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node, body, marker = mbs.AddNode, mbs.AddObject, mbs.AddMarker
    spring = items.ObjectConnectorCoordinateSpringDamper
    nodes, bodies, turns = [], [], []
    for i in range(n):
        nodes.append(node(items.NodeRigidBody2D(initialCoordinates=list(q[i]), initialVelocities=list(v[i]))))
        weight = {"mass": float(chain.mass[i]), "inertia": float(chain.inertia[i])}
        bodies.append(body(items.ObjectRigidBody2D(nodeNumber=nodes[-1], **weight)))
        centre = marker(items.MarkerBodyMass(bodyNumber=bodies[-1]))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=centre, loadVector=[0.0, -chain.gravity, 0.0]))
        turns.append(marker(items.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=2)))

    def pin(i, side):
        position = [side * chain.length[i] - chain.com_x[i], -chain.com_y[i], 0.0]
        return marker(items.MarkerBodyPosition(bodyNumber=bodies[i], localPosition=position))

    for i in range(n):
        k = (i + 1) % n
        body(items.ObjectJointRevolute2D(markerNumbers=[pin(i, 1), pin(k, 0)]))
        bushing = {"stiffness": chain.stiffness, "damping": chain.damping}
        free_angle = chain.free_angle + (2 * pi if k == 0 else 0.0)  # angles fall by one turn along the loop
        body(spring(markerNumbers=[turns[i], turns[k]], offset=free_angle, **bushing))
    floor = node(items.NodePointGround())
    fixed = marker(items.MarkerNodeCoordinate(nodeNumber=floor, coordinate=0))
    for inertia, drag in zip(wheels.inertia, wheels.drag, strict=True):
        at_rest = {"referenceCoordinates": [0.0], "initialCoordinates": [0.0], "initialVelocities": [0.0]}
        nodes.append(node(items.Node1D(**at_rest)))
        body(items.ObjectRotationalMass1D(inertia=inertia, nodeNumber=nodes[-1]))
        wheel = marker(items.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=0))
        body(spring(markerNumbers=[fixed, wheel], stiffness=0.0, damping=drag))
    after_step, memory = _add_contacts(exu, items, mbs, nodes, chain, start, contacts, drive)

    samples = round(duration / sample) + 1
    positions = np.zeros((samples, 3 * n))
    positions[0] = q.ravel()
    taken = [1]

    def at_end_of_step(mbs, t):
        after_step(t, mbs)
        if watch is not None:
            system = mbs.systemData
            watch(t, np.array(system.GetODE2Coordinates()), np.array(system.GetODE2Coordinates_t()), memory)
        if taken[0] < samples and t > taken[0] * sample - 1e-9:
            positions[taken[0]] = mbs.systemData.GetODE2Coordinates()[: 3 * n]
            # where Newton's iteration fails Exudyn takes a shorter step, and later ones end beside the samples
            if (beyond := t - taken[0] * sample) > 1e-9:
                positions[taken[0]] -= beyond * np.array(mbs.systemData.GetODE2Coordinates_t()[: 3 * n])
            taken[0] += 1
        return True

    mbs.SetPostStepUserFunction(at_end_of_step)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
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
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if reached is False:
        raise DivergenceError(f"exudyn: its solver gave up with a step of {step:g} s")
    positions = positions.reshape(samples, n, 3)
    times, centre, angle = np.arange(samples) * sample, positions[:, :, :2].copy(), positions[:, :, 2].copy()
    return PeerRun(times, centre, angle, _gaps(chain, positions), wall, cpu)


def _gaps(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Largest distance between the pins of any joint in every sample (s, n, 3), m."""
    c, s = np.cos(q[:, :, 2]), np.sin(q[:, :, 2])
    first, second = (
        q[:, :, :2] + np.stack([x * c + chain.com_y * s, x * s - chain.com_y * c], axis=2)
        for x in (-chain.com_x, chain.length - chain.com_x)
    )
    return np.hypot(*(np.roll(first, -1, axis=1) - second).transpose(2, 0, 1)).max(axis=1)


def _add_contacts(exu, items, mbs, nodes, chain, start, contacts, drive):
    """One object that carries the contact forces of all bodies and wheels; gives what to do after a step."""
    n = len(chain.length)
    count = len(contacts.circle)
    size = 3 * n + count - 1
    memory = Memory(start.tooth_impact.copy(), start.wheel_impact.copy())
    load, torque, force = np.zeros((n, 3)), np.zeros((n, count)), np.zeros(size)
    loads, torques = np.zeros((2, n, 3)), np.zeros((2, n, count))
    triplets = np.zeros(((5 + count) * n * (2 + count), 3))

    def sparse(rows):
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(rows, size, size, useDenseMatrix=False)
        return matrix

    def sprocket(t):
        turned, spin = drive_at(drive, t)
        return start.sprocket_angle + turned, spin

    def forces(mbs, t, item, q, v):
        angle, spin = sprocket(t)
        force_vector(contacts, chain.length, np.asarray(q), np.asarray(v), angle, spin, memory, load, torque, force)
        return force

    def jacobian(mbs, t, item, q, v, by_q, by_v):
        angle, spin = sprocket(t)
        q, v = np.array(q), np.array(v)
        state = contacts, chain.length, q, v, angle, spin, memory
        return sparse(triplets[: jacobian_triplets(*state, by_q, by_v, loads, torques, triplets)])

    # the bodies carry the masses; matrices are asked for all the same
    names = ("massMatrix", "stiffnessMatrix", "dampingMatrix")
    matrices = {name: sparse(np.array([[0.0, 0.0, 1e-30]])) for name in names}
    functions = {"forceUserFunction": forces, "jacobianUserFunction": jacobian}
    mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=nodes, **matrices, **functions))

    def after_step(t, mbs):
        angle, spin = sprocket(t)
        q, v = np.array(mbs.systemData.GetODE2Coordinates()), np.array(mbs.systemData.GetODE2Coordinates_t())
        peer_contact_loads(contacts, chain.length, q, v, angle, spin, memory, True, load, torque)

    return after_step, memory
