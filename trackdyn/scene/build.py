"""Arrays of the kernels from rig and scene."""

from collections.abc import Collection
from math import cos, nan, pi, radians, sin, sqrt, tan

import numpy as np

from trackdyn.contact.laws import FORMS
from trackdyn.inputs.errors import InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.integrate.suspensions import along, chain_force
from trackdyn.model import constants
from trackdyn.model.arrays import Work
from trackdyn.model.constants import LAW, SPROCKET, Chain, Drive, Law, Model, Sensors, Shoes, Space, Tooth, Wheels
from trackdyn.rig.groove import PROFILES
from trackdyn.rig.laws import NORMAL_LAWS, maxwell_elements
from trackdyn.rig.layout import body_lengths, tensioner, wheel_circles, wheel_names
from trackdyn.rig.rig import Rig
from trackdyn.rig.sections import Arm, SensorParameters, Sprocket, Surface, Wheel


def mobility_of_slip(chain: Chain, body: int, along: float, arm: float) -> tuple[float, float, float]:
    """Return the mobility of a point of a straight chain, acceleration per unit of force: ``a, b, c``, 1/kg.

    The point is ``arm`` (m) from a point on the body, ``along`` (m) from its input pin, against the contact's normal.
    Friction accelerates it by ``a x^2 + b x + c`` with the normal's component x along the chain, a force across the
    chain by ``a``. Pins turn freely: bushings add nothing within a few steps. The halves of the chain are reduced to
    masses at the body's pins, from the far end on as the sweep of Eqs. 2 to 5 does.
    """
    share, spin = chain.com_x / chain.length, chain.inertia / chain.length**2
    rest, mass = 1.0 - share, chain.mass
    # entries 00, 01 and 11 of every body's mass matrix over the velocities of its pins across itself, kg
    entries = mass * (rest * rest) + spin, mass * (rest * share) - spin, mass * (share * share) + spin
    first, both, last = (entry.tolist() for entry in entries)
    n = len(first)
    ahead = behind = 0.0  # masses that the chain shows at the output and at the input pin, kg
    for i in range(n - 1, 0, -1):
        k = (body + i) % n
        ahead = first[k] - both[k] ** 2 / (last[k] + ahead)
        k = (body - i) % n
        behind = last[k] - both[k] ** 2 / (first[k] + behind)
    own = np.array([[first[body], both[body]], [both[body], last[body]]])
    pins = np.linalg.inv(own + np.diag([behind, ahead]))  # (2, 2) accelerations of the pins by a unit force at each
    fraction, lever = along / chain.length[body], arm / chain.length[body]
    weights, turn = np.array([1.0 - fraction, fraction]), np.array([lever, -lever])
    return float(weights @ pins @ weights), float(2 * weights @ pins @ turn), float(turn @ pins @ turn)


def make_law(
    contact_length, composite_modulus, restitution, mu_s, mu_d, v_t, speed_floor, factor_limit, normal_law="printed",
    shear_stiffness=0.0,
) -> Law:  # fmt: skip
    """Return constants of Eqs. 8 and 10, or of Dahl's law with a ``shear_stiffness``, from material data (SI units)."""
    chosen = NORMAL_LAWS[normal_law]  # one that is unclipped reaches 1 + chi at first impact
    loss = chosen.loss(restitution)
    return Law(
        form=FORMS[chosen.form], stiffness=pi * contact_length * composite_modulus / (2 * sqrt(2.0)), loss=loss,
        friction_static=mu_s, friction_dynamic=mu_d, transition_velocity=v_t, shear_stiffness=shear_stiffness,
        speed_floor=speed_floor, factor_limit=max(factor_limit, 1.0 + loss) if chosen.unclipped else factor_limit,
    )  # fmt: skip


def make_tooth(groove, arc_radius: float, law: Law, present: bool = True) -> Tooth:
    """Precompute the constants of the area search from the groove's geometry."""
    beta = [(2 * k - 1) * pi / groove.teeth - pi / 2 for k in range(1, groove.teeth + 1)]  # Eq. 12
    centre_x, centre_y = np.ascontiguousarray(groove.centre.T)
    direction_x, direction_y = np.ascontiguousarray(groove.direction.T)
    return Tooth(
        present=int(present), centre_x=centre_x, centre_y=centre_y, radius=groove.radius.copy(),
        direction_x=direction_x, direction_y=direction_y, cos_half_angle=np.cos(groove.half_angle),
        convex=groove.convex.astype(np.int64), groove_cos=np.array([cos(b) for b in beta]),
        groove_sin=np.array([sin(b) for b in beta]), teeth=groove.teeth, half_pitch=tan(pi / groove.teeth),
        addendum=groove.addendum, arc_radius=arc_radius, law=law,
    )  # fmt: skip


def build_chain(rig: Rig, chain: str = "double_pin", viscous: bool = True) -> Chain:
    """Return links and connectors in turn, or one body a pitch, mass centres in the middle; dampers if ``viscous``."""
    c, n = rig.chain, rig.chain.pitches
    if chain == "single_pin":
        # half a connector is fixed to each end of the link, its middle a quarter of a connector from the joint
        pitch, half = rig.single_pin_pitch, c.connector_mass / 2
        connector = c.connector_inertia / 2 - half * (rig.connector_length / 4) ** 2
        pitch_inertia = c.link_inertia + 2 * (connector + half * (pitch / 2 - rig.connector_length / 4) ** 2)
        mass, inertia = np.full(n, c.link_mass + c.connector_mass), np.full(n, pitch_inertia)
    else:
        mass, inertia = np.tile([[c.link_mass, c.connector_mass], [c.link_inertia, c.connector_inertia]], n)
    length, in_series = body_lengths(rig, chain), 2 if chain == "single_pin" else 1  # bushings behind one another
    return Chain(
        length=length, mass=mass, inertia=inertia, com_x=length / 2, com_y=np.zeros(len(length)),
        stiffness=rig.bushing.stiffness / in_series, damping=rig.bushing.damping / in_series if viscous else 0.0,
        free_angle=rig.bushing.free_angle * in_series, gravity=rig.gravity,
    )  # fmt: skip


def build_shoes(rig: Rig, chain: str = "double_pin") -> Shoes:
    """Return the positions of the links and the connectors' arcs on the bodies."""
    n, a = rig.chain.pitches, rig.chain.link_length
    pitch = np.arange(n)
    if chain == "single_pin":
        # a link with an arc of the adjacent connectors at each end, and joints where the middle lines of two links meet
        # at equal pitch: arcs and links are in the grooves and on the ring as in double pin
        start = (rig.single_pin_pitch - a) / 2
        body, arc_body = pitch, np.column_stack([pitch, (pitch + 1) % n]).ravel()
        arcs = [start + a, start]
    else:
        start, body, arc_body, arcs = 0.0, 2 * pitch, np.repeat(2 * pitch + 1, 2), [0.0, rig.connector_length]
    ends = {"link_start": np.full(n, start), "link_end": np.full(n, start + a)}
    return Shoes(link_body=body, arc_body=arc_body, arc_x=np.tile(arcs, n), **ends)


def build_sensors(shoes: Shoes, sensors: Collection[SensorParameters]) -> Sensors:
    """Return positions of sensors: on a link from its end A, on a connector from its first pin."""
    on_link = np.array([sensor.body == "link" for sensor in sensors])
    pitch = np.array([sensor.pitch for sensor in sensors]) - 1
    body = np.where(on_link, shoes.link_body[pitch], shoes.arc_body[2 * pitch])
    start = np.where(on_link, shoes.link_start[pitch], 0.0)
    x, y = np.array([(sensor.x, sensor.y) for sensor in sensors]).T
    return Sensors(body, x + start, y.copy())


def _law(rig: Rig, surface: Surface, scene) -> Law:
    sliding = scene.friction != "none"
    mu_s, mu_d = (surface.friction_static, surface.friction_dynamic) if sliding else (0.0, 0.0)
    gives_way = sliding and surface.friction_law == "dahl"
    return make_law(
        surface.contact_length, rig.composite_modulus(surface), surface.restitution, mu_s, mu_d,
        surface.transition_velocity, rig.impact.speed_floor, rig.impact.factor_limit, scene.normal_law,
        surface.shear_stiffness if gives_way else 0.0,
    )  # fmt: skip


def build_wheels(scene) -> Wheels:
    """Return the wheels of a scene, the sprocket with its ring first."""
    rig = scene.rig
    circles = wheel_circles(rig, surface=True)
    if scene.ring_radius is not None:
        circles[SPROCKET, 2] = scene.ring_radius
    rollers = list(rig.wheels.values())
    surfaces = [rig.ring_contact, *(rig.contact_surfaces[roller.surface] for roller in rollers)]
    x, y, radius = np.ascontiguousarray(circles.T)

    def column(field: str, law: str = scene.drag) -> np.ndarray:
        """Return a field of all wheels, zero for the sprocket and if the scene has another law of drag."""
        return np.array([0.0, *(getattr(roller, field) * (scene.drag == law) for roller in rollers)])

    brake = np.zeros(len(x))  # N m
    if scene.load:
        wheel, lever = scene.braked_wheel
        brake[wheel] = scene.load * lever
    return Wheels(
        present=np.array([int(scene.ring_radius is not None)] + [1] * len(rollers)), x=x, y=y, radius=radius,
        inertia=column("inertia"), drag=column("bearing_drag", "viscous") + column("seal_drag", "rolling"),
        torque=column("bearing_torque", "coulomb") + brake,
        half_thickness=rig.chain.link_thickness / 2, slip=np.zeros(len(x)),
        law=np.array([_law(rig, surface, scene) for surface in surfaces], LAW),
        rolling=column("rolling_arm", "rolling"),
    )  # fmt: skip


def _slip_on_wheels(chain: Chain, wheels: Wheels, link: int) -> np.ndarray:
    """Return the mobility of a sliding link on every wheel, 1/kg: the link's own plus that of the wheel's rotation."""
    *_, turning = mobility_of_slip(chain, link, 0.0, wheels.half_thickness)
    radius = wheels.radius + wheels.half_thickness
    shared = pi * radius / (chain.length.sum() / len(chain.length)) / 2  # links on half of a wheel, every other body
    ratio = np.divide(shared * radius**2, wheels.inertia, out=np.zeros(len(radius)), where=wheels.inertia > 0)
    ratio[SPROCKET] = 0.0  # turned by its drive
    return 1.0 / chain.mass[link] + turning + ratio


def wheel_frame(toe: float, camber: float) -> np.ndarray:
    """Return ``A_W``, from the wheel's frame to the inertial one: ``A_y(toe) A_x(camber)``; angles in rad."""
    ct, st, cc, sc = np.cos(toe), np.sin(toe), np.cos(camber), np.sin(camber)
    about_y = np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cc, -sc], [0.0, sc, cc]])
    return about_y @ about_x


def wheel_centres(rig: Rig, wheels: Wheels) -> np.ndarray:
    """Return the (w, 3) inertial positions of the wheels' middles, m."""
    parts: list[Sprocket | Wheel] = [rig.sprocket, *rig.wheels.values()]
    return np.array([[x, y, wheel.axial_offset] for x, y, wheel in zip(wheels.x, wheels.y, parts, strict=False)])


def build_space(scene, tooth: Tooth, wheels: Wheels) -> Space:
    """Return constants of the motion in space of links and connectors around wheels, the sprocket with ``tooth``."""
    rig = scene.rig
    parts = (rig.sprocket, *rig.wheels.values())[: len(wheels.x)]
    frame = np.array([wheel_frame(radians(wheel.toe), radians(wheel.camber)) for wheel in parts])
    # flanges hold connectors' guides as far out as teeth reach (Eq. 18), else half a link's thickness above the links
    reach = np.where(wheels.present, wheels.radius + 2 * wheels.half_thickness, 0.0)
    if tooth.present:
        reach[SPROCKET] = tooth.addendum + tooth.arc_radius
    surfaces = (rig.wheel_contact, rig.tooth_contact, rig.ring_contact)  # in the order of `model.arrays.SURFACE`
    c, pitches, friction = rig.chain, rig.chain.pitches, scene.fidelity["friction"].setting
    return Space(
        along=np.tile([c.link_inertia_along, c.connector_inertia_along], pitches),
        across=np.tile([c.link_inertia_across, c.connector_inertia_across], pitches),
        frame=frame, centre=np.einsum("wji,wj->wi", frame, wheel_centres(rig, wheels)),
        length=np.array([surface.contact_length for surface in surfaces]),
        overhang=np.array([surface.axial_overhang for surface in surfaces]), guide_reach=reach,
        **{name: float(value) for name, value in rig.guide},
        friction=constants.INDEPENDENT if friction == "independent" else constants.TANGENTIAL,
    )  # fmt: skip


def build_model(scene) -> Model:
    """Build the model of a scene, the tensioning wheel at its nominal position; see ``Scene.model``."""
    rig = scene.rig
    toothed, hysteretic = scene.tooth_contact != "none", scene.bushing_law == "hysteretic"
    groove = PROFILES.get(scene.tooth_contact, PROFILES["ten_arcs"])(rig)  # the rig's without tooth contact
    shoes, chain = build_shoes(rig, scene.chain), build_chain(rig, scene.chain, not hysteretic)
    maxwell = constants.NO_MAXWELL
    if hysteretic and rig.bushing.loss_factor * rig.bushing.stiffness > 0:
        share, time = maxwell_elements(rig.bushing.loss_factor)
        maxwell = constants.Maxwell(chain.stiffness * share, time)
    tooth = make_tooth(groove, rig.chain.connector_radius, _law(rig, rig.tooth_contact, scene), toothed)
    wheels = build_wheels(scene)
    if METHODS[scene.integrator].staggered:
        sides = zip(shoes.arc_body[:2], shoes.arc_x[:2], strict=True)
        slip = [mobility_of_slip(chain, body, at, tooth.arc_radius) for body, at in sides]
        tooth = tooth._replace(mobility=slip[0][0], slip=np.array(slip))
        wheels = wheels._replace(slip=_slip_on_wheels(chain, wheels, int(shoes.link_body[0])))
    c, drive = rig.closure, Drive(float(scene.sprocket_rate), float(scene.ramp))
    return Model(
        chain=chain, shoes=shoes, tooth=tooth, wheels=wheels, drive=drive,
        sensors=build_sensors(shoes, rig.sensors.values()),
        closure=constants.Closure(int(scene.closure == "elastic_damping"), stiffness=c.stiffness, damping=c.damping),
        step=nan, stride=0,  # `Scene.model_of_step`
        space=build_space(scene, tooth, wheels) if scene.fidelity["space"].setting == "spatial" else None,
        maxwell=maxwell, suspensions=suspensions_of([], len(wheels.x)),
    )  # fmt: skip


def make_suspensions(rig: Rig, model: Model, tension: str, shift: float) -> constants.Suspensions:
    """Return suspensions at rest on the model's wheels, without preload; a sprung tensioner is shifted (m)."""
    rows = []
    for k, name in enumerate(wheel_names(rig)):
        tensions = k == tensioner(rig) and tension == "sprung"
        suspension = rig.tension if tensions else rig.wheels[name].suspension if k else None
        if suspension is None:
            continue
        x, y = float(model.wheels.x[k]), float(model.wheels.y[k])
        if isinstance(suspension, Arm):
            dx, dy, travel = x - suspension.x, y - suspension.y, radians(suspension.travel)
            row = {"arm": 1, "x": suspension.x, "y": suspension.y, "along_x": -dy, "along_y": dx, "low": -travel}
            row |= {"mass": suspension.mass * (dx**2 + dy**2), "weight": suspension.mass * rig.gravity, "high": travel}
        else:
            direction, at = radians(suspension.direction), shift if tensions else 0.0
            row = {"x": x, "y": y, "along_x": cos(direction), "along_y": sin(direction), "mass": suspension.mass}
            row |= {"low": -suspension.travel - at, "high": suspension.travel - at}
        rows.append(row | {"wheel": k, "damping": suspension.damping, "stiffness": suspension.stiffness})
    return suspensions_of(rows, len(model.wheels.x))


def suspensions_of(rows: list[dict], wheels: int) -> constants.Suspensions:
    """Return suspensions from a row of fields each, without preload."""
    kinds = dict.fromkeys(constants.Suspensions._fields, float) | {"wheel": int, "arm": int}
    columns = {name: np.array([row.get(name, 0.0) for row in rows], kind) for name, kind in kinds.items()}
    columns["of_wheel"] = np.full(wheels, -1)
    columns["of_wheel"][columns["wheel"]] = np.arange(len(rows))
    return constants.Suspensions(**columns)


def preloads(rig: Rig, suspensions: constants.Suspensions, work: Work) -> np.ndarray:
    """Return (k,) preloads that balance the chain with the suspensions at rest, or the rig's own."""
    names, forces = wheel_names(rig), np.zeros(len(suspensions.wheel))
    for k, wheel in enumerate(suspensions.wheel):
        suspension = None if wheel == tensioner(rig) else rig.wheels[names[wheel]].suspension
        (tx, ty), (fx, fy) = along(suspensions, k, 0.0), chain_force(work, wheel)
        if suspension is None or suspension.preload is None:
            forces[k] = suspensions.weight[k] * ty - (tx * fx + ty * fy)
        else:
            slid = 0.0 if isinstance(suspension, Arm) else suspension.mass * rig.gravity * ty
            forces[k] = suspension.preload - slid
    return forces


def check_stops(rig: Rig, suspensions: constants.Suspensions, slide: np.ndarray) -> None:
    """Raise `InputError` if a suspension settles (``slide``) at a stop, where its spring does not carry the wheel."""
    for k, wheel in enumerate(suspensions.wheel):
        q, name = float(slide["q"][k]), wheel_names(rig)[wheel]
        if not suspensions.low[k] < q < suspensions.high[k]:
            kind = "arm" if suspensions.arm[k] else "slider"
            section = "tension" if wheel == tensioner(rig) else f"{name}.{kind}"
            stop = f"wheel {name} rests on a stop of its {kind} once the loop has settled"
            remedy = "change the preload or force, stiffen the spring or allow more travel"
            raise InputError(f"{section}.travel: {stop}; {remedy}")
