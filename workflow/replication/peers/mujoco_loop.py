"""The same loop in MuJoCo, with contacts of its own: another model of the same layout, masses, bushings and drive.

The bodies are one tree of hinges from the one in the middle of the chain to both sides, closed by a constraint
(``connect``); the bushing of that joint is a tendon over all hinges, whose length is the turn that they make together.
The sprocket's hinge is so heavy that nothing turns it, and its angle and rate are written before every step. What
touches, and how, is in `peers.mujoco_contact`: places and working loads are the rig's, the law is MuJoCo's.
"""

import time
from math import pi

import numpy as np

from replication.peers.contact import Contacts, make_contacts
from replication.peers.exudyn_loop import PeerRun, PeerStart, PeerWheels, drive_at, free_wheels, start_of
from replication.peers.mujoco_contact import ACROSS, RUBBER, STEEL, cushion, soft, sprocket_shapes
from trackdyn.errors import DivergenceError, InputError
from trackdyn.extras import required
from trackdyn.model.constants import Chain, Drive
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

HEAVY = 1e4  # of the sprocket's hinge, kg m2
# Time constant of the closing constraint, s, at least two steps long; and its impedance, next to rigid.
CLOSING, RIGID = 2e-3, 0.9999
PLANE = [0.0, 0.0, 1.0]  # axis of all hinges


def working_load(scene: Scene) -> tuple[float, float]:
    """Load of a link on the ring under the pre-tension (N), and the speed at which links meet it (m/s).

    A strand of tension T on a circle of radius r bears T / r on every metre of it; a link that tips onto a circle
    turning at some rate does so about a point half a pitch away.
    """
    rig = scene.rig
    pitch = rig.chain.link_length + rig.connector_length
    radius = (scene.ring_radius or rig.sprocket.ring_radius) + rig.chain.link_thickness / 2
    return rig.tension.pre_tension * pitch / radius, max(abs(scene.sprocket_rate) * pitch / 2, rig.impact.speed_floor)


def build(
    chain: Chain,
    step: float,
    contacts: Contacts | None = None,
    wheels: PeerWheels | None = None,
    load: float = 1.0,
    speed: float = 1.0,
    integrator: str = "euler",
):
    """A compiled ``MjModel``.

    Contacts are matched at a load and speed (`working_load`); without contacts and wheels it is a free chain.
    """
    mj = required("mujoco")
    spec = mj.MjSpec()
    spec.compiler.degree = False
    option = spec.option
    option.timestep, option.gravity = step, [0.0, -chain.gravity, 0.0]
    option.integrator = getattr(mj.mjtIntegrator, f"mjINT_{integrator.upper()}")
    option.solver, option.jacobian = mj.mjtSolver.mjSOL_NEWTON, mj.mjtJacobian.mjJAC_DENSE
    # pyramids would have another stiffness than that of the law
    option.cone, option.impratio = mj.mjtCone.mjCONE_ELLIPTIC, ACROSS
    option.disableflags |= int(mj.mjtDisableBit.mjDSBL_AUTORESET)  # a run that blows up shall end
    bodies = _add_chain(mj, spec, chain, contacts)
    if contacts is not None:
        _add_wheels(mj, spec, bodies, contacts, wheels, load, speed)
    model = spec.compile()
    # the diagonal that impedances scale with: 1 / kg for a body of the chain on a wheel
    model.body_invweight0[:] = 0.0
    for i in range(len(chain.length)):
        model.body_invweight0[model.body(f"body{i}").id] = 1.0
    return model


def _plain(parent, name: str, place, mass: float, inertia: float, centre=(0.0, 0.0)):
    """A body whose mass is given; what stands across the plane never turns."""
    about = {"mass": float(mass), "inertia": [float(inertia)] * 3, "ipos": [*centre, 0.0], "explicitinertial": True}
    return parent.add_body(name=name, pos=[*place, 0.0], **about)


def _add_chain(mj, spec, chain: Chain, contacts: Contacts | None) -> list:
    n, middle = len(chain.length), len(chain.length) // 2
    bushing = {"stiffness": _first(chain.stiffness), "damping": _first(chain.damping), "springref": chain.free_angle}
    bodies: list = [None] * n
    for i in [*range(middle, n), *range(middle - 1, -1, -1)]:
        later = i > middle
        parent = spec.worldbody if i == middle else bodies[i - 1 if later else i + 1]
        place = (0.0, 0.0) if i == middle else (chain.length[i - 1] if later else -chain.length[i], 0.0)
        about = chain.mass[i], chain.inertia[i], (chain.com_x[i], chain.com_y[i])
        body = bodies[i] = _plain(parent, f"body{i}", place, *about)
        if i == middle:
            for name, axis in (("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0])):
                body.add_joint(name=name, type=mj.mjtJoint.mjJNT_SLIDE, axis=axis)
            body.add_joint(name="turn", type=mj.mjtJoint.mjJNT_HINGE, axis=PLANE)
        elif later:
            body.add_joint(name=f"joint{i}", type=mj.mjtJoint.mjJNT_HINGE, axis=PLANE, **bushing)
        else:  # its output pin is the hinge; the angle is again that of the later body against the earlier one
            where = {"axis": [0.0, 0.0, -1.0], "pos": [chain.length[i], 0.0, 0.0]}
            body.add_joint(name=f"joint{i + 1}", type=mj.mjtJoint.mjJNT_HINGE, **where, **bushing)
        if contacts is not None:
            _add_shape(mj, body, i, chain.length[i], contacts)
    bodies[0].add_site(name="first", pos=[0.0, 0.0, 0.0])
    bodies[-1].add_site(name="last", pos=[chain.length[-1], 0.0, 0.0])
    spec.add_equality(
        name="closure", type=mj.mjtEq.mjEQ_CONNECT, objtype=mj.mjtObj.mjOBJ_SITE, name1="last", name2="first",
        solref=[CLOSING, 1.0], solimp=[RIGID, RIGID, 1.0, 0.5, 1.0],
    )  # fmt: skip
    # angles fall by one turn along the loop: what the hinges lack of it is the angle of the cut joint
    rest = -2 * pi - chain.free_angle
    law = {name: bushing[name] for name in ("stiffness", "damping")}
    tendon = spec.add_tendon(name="cut", **law, springlength=[rest, rest])
    for i in range(1, n):
        tendon.wrap_joint(f"joint{i}", 1.0)
    return bodies


def _first(value: float) -> list[float]:
    """Coefficients of a polynomial that is linear."""
    return [float(value), 0.0, 0.0]


def _add_shape(mj, body, i: int, length: float, contacts: Contacts) -> None:
    """A link's bar, which wheels name themselves (pairs), or the two arcs of a connector, which meet the sprocket."""
    if i % 2 == 0:
        about = {"fromto": [0.0, 0.0, 0.0, length, 0.0, 0.0], "size": [contacts.half_thickness, 0.0, 0.0]}
        body.add_geom(name=f"link{i}", type=mj.mjtGeom.mjGEOM_CAPSULE, **about, contype=0, conaffinity=0)
        return
    for side, x in enumerate((0.0, length)):
        about = {"pos": [x, 0.0, 0.0], "size": [contacts.arc_radius, 0.0, 0.0]}
        body.add_geom(name=f"arc{i}_{side}", type=mj.mjtGeom.mjGEOM_SPHERE, **about, contype=1, conaffinity=0)


def _add_wheels(mj, spec, bodies: list, contacts: Contacts, wheels: PeerWheels, load: float, speed: float) -> None:
    sphere, hinge = mj.mjtGeom.mjGEOM_SPHERE, mj.mjtJoint.mjJNT_HINGE
    for k, (x, y, radius) in enumerate(contacts.circle):
        wheel = _plain(spec.worldbody, f"wheel{k}", (x, y), 1.0, wheels.inertia[k - 1] if k else 1.0)
        drag = {"damping": _first(wheels.drag[k - 1])} if k else {"armature": HEAVY}
        wheel.add_joint(name=f"wheel{k}", type=hinge, axis=PLANE, **drag)
        if k == 0 and contacts.teeth:
            _add_teeth(mj, wheel, contacts, load, speed)
        if radius == 0.0:
            continue
        wheel.add_geom(name=f"rim{k}", type=sphere, size=[radius, 0.0, 0.0], contype=0, conaffinity=0)
        given = cushion(contacts.law[k + 1], radius, load, speed, RUBBER)
        law = {"condim": 3, "friction": [given.friction] * 2 + [0.0] * 3, **soft(given)}
        for i in range(0, len(bodies), 2):
            spec.add_pair(name=f"pair{k}_{i}", geomname1=f"rim{k}", geomname2=f"link{i}", **law)


def _add_teeth(mj, wheel, contacts: Contacts, load: float, speed: float) -> None:
    """Steel of the sprocket. The seat is where connectors bear: the concave area with the largest extent."""
    hollow = contacts.arc[contacts.sign < 0]
    seat = hollow[np.argmax(hollow[:, 2] * hollow[:, 5]), 2] - contacts.arc_radius
    given = cushion(contacts.law[0], seat, load, speed, STEEL)
    law = {key: value for key, value in soft(given).items() if key != "solreffriction"}
    about = {"contype": 0, "conaffinity": 1, "condim": 3, "priority": 1, "friction": [given.friction, 0.0, 0.0], **law}
    discs, facets = sprocket_shapes(contacts)
    for k, (centre, radius) in enumerate(discs):
        place = {"pos": [*centre, 0.0], "size": [radius, 0.0, 0.0]}
        wheel.add_geom(name=f"disc{k}", type=mj.mjtGeom.mjGEOM_SPHERE, **place, **about)
    for k, (first, second, radius) in enumerate(facets):
        ends = [*first, 0.0, *second, 0.0]
        wheel.add_geom(name=f"facet{k}", type=mj.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[radius, 0.0, 0.0], **about)


def lay(model, data, chain: Chain, start: PeerStart) -> None:
    """Put the start of a run into ``data``."""

    def put(name, place, rate):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = place, rate

    middle = len(chain.length) // 2
    cos, sin = np.cos(start.angle[:middle]), np.sin(start.angle[:middle])
    length, swing = chain.length[:middle], chain.length[:middle] * start.rate[:middle]
    put("x", start.pin[0] + length @ cos, start.pin[2] - swing @ sin)
    put("y", start.pin[1] + length @ sin, start.pin[3] + swing @ cos)
    put("turn", start.angle[middle], start.rate[middle])
    for i in range(1, len(chain.length)):
        put(f"joint{i}", start.angle[i] - start.angle[i - 1], start.rate[i] - start.rate[i - 1])


def places(model, chain: Chain, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass centres (s, n, 2), m, angles (s, n), rad, and gap of the closing joint (s,), m, from coordinates (s, nq)."""
    middle = len(chain.length) // 2

    def column(name):
        return kept[:, model.joint(name).qposadr[0]]

    angle = np.zeros((len(kept), len(chain.length)))
    for i in range(1, len(chain.length)):
        angle[:, i] = angle[:, i - 1] + column(f"joint{i}")
    angle += (column("turn") - angle[:, middle])[:, None]
    cos, sin = np.cos(angle), np.sin(angle)
    steps = chain.length[:, None] * np.stack([cos, sin], axis=2)
    ends = np.cumsum(steps, axis=1)
    pins = ends - steps
    pins += (np.stack([column("x"), column("y")], axis=1) - pins[:, middle])[:, None]
    arm = np.stack([chain.com_x * cos - chain.com_y * sin, chain.com_x * sin + chain.com_y * cos], axis=2)
    return pins + arm, angle, np.hypot(*ends[:, -1].T)


def run_mujoco_loop(
    model, chain: Chain, start: PeerStart, duration: float, sample: float, drive: Drive = Drive(0.0, 1.0)
) -> PeerRun:
    """Integrate with MuJoCo.

    ``sample``, the time between samples (s), is a multiple of the step; free wheels start at rest.

    Raises
    ------
    InputError
        If the sample is no multiple of the step.
    DivergenceError
        If MuJoCo warns: of numbers that are not finite above all.
    """
    mj = required("mujoco")
    data = mj.MjData(model)
    lay(model, data, chain, start)
    step, samples = float(model.opt.timestep), round(duration / sample) + 1
    every = round(sample / step)
    if every < 1 or abs(every * step - sample) > 1e-9:
        raise InputError(f"mujoco: step = {step:g} s: must divide the sample interval, {sample:g} s")
    rims = [model.joint(f"wheel{k}") for k in range(model.nbody - 1 - len(chain.length))]
    kept, rate = np.zeros((samples, model.nq)), np.zeros((samples, max(len(rims) - 1, 0)))
    kept[0] = data.qpos
    place, turning = (rims[0].qposadr[0], rims[0].dofadr[0]) if rims else (0, 0)
    free = [joint.dofadr[0] for joint in rims[1:]]
    qpos, qvel, advance, turned = data.qpos, data.qvel, mj.mj_step, 0.0
    # warnings are counted below; left alone, MuJoCo writes them into a file in the working folder
    mj.set_mju_user_warning(lambda text: None)
    wall, cpu = time.perf_counter(), time.process_time()
    for taken in range(1, (samples - 1) * every + 1):
        if rims:
            after = drive_at(drive, taken * step)[0]
            qpos[place], qvel[turning] = start.sprocket_angle + turned, (after - turned) / step
            turned = after
        advance(model, data)
        if taken % every == 0:
            kept[taken // every], rate[taken // every] = qpos, qvel[free]
            if data.warning.number.any() or not np.isfinite(qpos).all():
                raise DivergenceError(f"mujoco: its motion is no longer finite with a step of {step:g} s")
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    centre, angle, gap = places(model, chain, kept)
    return PeerRun(np.arange(samples) * sample, centre, angle, rate, gap, wall, cpu)


def run_mujoco(scene: Scene, integrator: str, step: float) -> PeerRun:
    """A scene's ramp and duration from the simulator's own settled start."""
    loop = Loop(scene)
    model = loop.model
    free = free_wheels(scene, model)
    contacts = make_contacts(scene, loop.layout["tensioner_shift_m"])
    built = build(model.chain, step, contacts, free, *working_load(scene), integrator)
    times = scene.ramp + scene.duration, 1.0 / scene.rig.sensor.rate
    return run_mujoco_loop(built, model.chain, start_of(loop.state), *times, model.drive)
