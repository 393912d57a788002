"""Problems of the benchmark: written from a rig file, and turned into the arrays that simulators take."""

import json
from math import cos, pi, sin, tan
from pathlib import Path

import numpy as np

from laboratory.benchmark.problems import FOLDER, NAMES, START_COLUMNS
from replication.peers.contact import Contacts
from trackdyn.files import write_text
from trackdyn.integrate.methods import METHODS
from trackdyn.model.constants import SPROCKET, Chain, Closure, Drive, Law, Model, Sensor, Shoes, Tooth, Wheels
from trackdyn.model.state import State, make_state
from trackdyn.parameters.rig import load_rig
from trackdyn.scene.build import carriers_of, with_mobility
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

RIG = Path(__file__).with_name("rig.yaml")
INTERVAL, STEP = 1e-3, 2e-5  # s: of reports; of the settling
BODIES = ("length_m", "mass_kg", "inertia_kg_m2")
LAW = dict(
    zip(
        Law._fields,
        ("stiffness_n_m", "loss", "friction_static", "friction_dynamic", "transition_velocity_m_s",
         "speed_floor_m_s", "factor_limit"),
        strict=True,
    )
)  # fmt: skip
LAWS = {"drag": "viscous", "bushing_law": "viscous", "tension": "locked", "integrator": "semi_implicit", "step": STEP}
MOTOR_RPM = 180.0
FREE_DAMPING = 1.0  # N m s/rad: an explicit step of a millisecond is then stable
RING_DRAG = 2.0  # N m s/rad: what the ring can carry by friction, so that links roll and creep but do not slide
ENDS = {"free_chain": (4.0, 0.0), "ring": (2.0, 0.8), "teeth": (3.0, 0.8)}  # s: end, begin of the window


def scene_of(name: str) -> Scene:
    """The scene whose model a problem is; its laws are named, whatever the defaults are."""
    rig = load_rig(RIG)
    if name == "free_chain":
        rig = rig.changed(gravity=0.0, bushing__damping=FREE_DAMPING)
        return Scene(rig, MOTOR_RPM, None, loop="free", ramp=0.5, **LAWS)
    radius, teeth = None, "ten_arcs"
    if name == "ring":
        rig = rig.changed(idler__bearing_drag=RING_DRAG, road_wheel__bearing_drag=RING_DRAG)
        radius, teeth = rig.ring_radius, "none"
    return Scene(rig, MOTOR_RPM, radius, tooth_contact=teeth, ramp=0.5, **LAWS)


def problem_of(name: str, model: Model, sprocket_angle: float) -> dict:
    """Statement of a problem."""
    chain, wheels, tooth = model.chain, model.wheels, model.tooth
    parts = [
        dict(zip(BODIES, map(float, row), strict=True))
        for row in np.column_stack([chain.length, chain.mass, chain.inertia])[:2]
    ]
    end, begin = ENDS[name]
    said = {
        "format": 1,
        "problem": name,
        "units": "SI; angles in rad, counter-clockwise from +x; the chain runs clockwise",
        "gravity_m_s2": chain.gravity,
        "chain": {"bodies": len(chain.length), "link": parts[0], "connector": parts[1]},
        "bushing": {
            "stiffness_n_m_rad": chain.stiffness,
            "damping_n_m_s_rad": chain.damping,
            "free_angle_rad": chain.free_angle,
        },
        "report": {"interval_s": INTERVAL, "end_s": end, "window_s": [begin, end], "body": 1},
    }
    if name == "free_chain":
        return said
    said["drive"] = {
        "rate_rad_s": model.drive.rate,
        "ramp_s": model.drive.ramp,
        "start_angle_rad": sprocket_angle,
    }
    said["link_half_thickness_m"] = wheels.half_thickness
    said["wheels"] = [
        {"name": label, "x_m": x, "y_m": y, "radius_m": r, "inertia_kg_m2": inertia, "drag_n_m_s_rad": drag}
        for label, x, y, r, inertia, drag in zip(
            ("ring", "idler", "road_wheel"),
            *(map(float, getattr(wheels, k)) for k in ("x", "y", "radius", "inertia", "drag")),
            strict=False,  # without a ring the free chain has one wheel
        )
        if label != "ring" or name == "ring"
    ]
    for wheel in said["wheels"]:
        wheel["law"] = "ring" if wheel["name"] == "ring" else "wheel"
    if name == "ring":
        del said["wheels"][0]["inertia_kg_m2"], said["wheels"][0]["drag_n_m_s_rad"]  # it turns with the sprocket

    def law(one):
        return {key: float(getattr(one, field)) for field, key in LAW.items()}

    said["laws"] = {"wheel": law(wheels.wheel_law)}
    if name == "ring":
        said["laws"]["ring"] = law(wheels.ring_law)
        return said
    said["laws"]["tooth"] = law(tooth.law)
    profile = load_rig(RIG).groove_profile
    said["sprocket"] = {
        "x_m": float(wheels.x[SPROCKET]),
        "y_m": float(wheels.y[SPROCKET]),
        "teeth": tooth.teeth,
        "addendum_m": tooth.addendum,
        "connector_arc_m": tooth.arc_radius,
        "areas": [
            {
                "area": j + 1,
                "kind": "convex" if profile.convex[j] else "concave",
                "centre_m": profile.centre[j].tolist(),
                "radius_m": float(profile.radius[j]),
                "direction": profile.direction[j].tolist(),
                "half_angle_rad": float(profile.half_angle[j]),
            }
            for j in range(len(profile.radius))
        ],
    }
    return said


def write_problem(name: str, folder: Path = FOLDER) -> None:
    """Write statement and initial state of a problem: the settled loop, at rest; the free one spins."""
    loop = Loop(scene_of(name))
    rate = np.zeros_like(loop.rates) if name != "free_chain" else loop.rates
    angle = loop.angles
    centre, chain = loop.mass_centres, loop.model.chain
    arm = (centre - loop.pins[:-1])[:, :, None]
    velocity = np.zeros_like(centre)
    if name == "free_chain":
        velocity = np.column_stack([loop.work.com_vx, loop.work.com_vy])
    assert np.allclose(np.hypot(*arm[:, :, 0].T), chain.com_x)  # in the middle of the pins
    table = np.column_stack([np.arange(1, len(angle) + 1), centre, angle, velocity, rate])
    rows = [",".join([f"{int(row[0])}", *(repr(float(v)) for v in row[1:])]) for row in table]
    write_text(folder / f"{name}_start.csv", "\n".join([",".join(START_COLUMNS), *rows, ""]))
    said = problem_of(name, loop.model, float(loop.state.wheel_angle[SPROCKET]))
    write_text(folder / f"{name}.json", json.dumps(said, indent=1) + "\n")


def chain_of(said: dict) -> Chain:
    """The chain of a problem."""
    half = said["chain"]["bodies"] // 2
    length, mass, inertia = (
        np.tile([said["chain"]["link"][key], said["chain"]["connector"][key]], half) for key in BODIES
    )
    return Chain(length, mass, inertia, length / 2, np.zeros(2 * half), *said["bushing"].values(), said["gravity_m_s2"])


def law_of(said: dict, name: str) -> Law:
    """A law of a problem; one that does not occur is any other."""
    row = said.get("laws", {}).get(name)
    return Law(*row.values()) if row else Law(1.0, 0.0, 0.0, 0.0, 1.0, 0.1, 3.0)


def model_of(said: dict, integrator: str, step: float) -> Model:
    """What the kernels of this simulator take."""
    chain = chain_of(said)
    n = len(chain.length)
    even = 2 * np.arange(n // 2)
    shoes = Shoes(
        even,
        np.zeros(n // 2),
        chain.length[even].copy(),
        np.repeat(even + 1, 2),
        np.tile([0.0, chain.length[1]], n // 2),
    )
    sprocket, wheels = said.get("sprocket"), {w["name"]: w for w in said.get("wheels", [])}
    order = [wheels.get(name) for name in ("ring", "idler", "road_wheel")] if wheels else []

    def column(key, other=0.0):
        return np.array([float(w.get(key, other)) if w else other for w in order] or [other])

    x, y, radius = column("x_m"), column("y_m"), column("radius_m")
    around = Wheels(
        np.array([int(w is not None) for w in order] or [0]), x, y, radius, column("inertia_kg_m2", 1.0),
        column("drag_n_m_s_rad"), np.zeros(len(x)), said.get("link_half_thickness_m", 0.0), np.zeros(len(x)),
        law_of(said, "ring"), law_of(said, "wheel"), np.zeros(len(x)),
    )  # fmt: skip
    tooth = tooth_of(sprocket, law_of(said, "tooth"))
    if METHODS[integrator].staggered:
        tooth, around = with_mobility(chain, shoes, tooth, around, held=True)
    drive = said.get("drive", {"rate_rad_s": 0.0, "ramp_s": 1.0})
    stride = round(said["report"]["interval_s"] / step)
    return Model(
        chain, shoes, tooth, around, Drive(drive["rate_rad_s"], drive["ramp_s"]),
        Sensor(said["report"]["body"] - 1, float(chain.com_x[0]), 0.0), Closure(0, 1e9, 1e4),
        said["report"]["interval_s"] / stride, stride, carriers_of([], len(x)),
    )  # fmt: skip


def tooth_of(sprocket: dict | None, law: Law) -> Tooth:
    """The sprocket's teeth; none without a sprocket."""
    teeth = sprocket["teeth"] if sprocket else 13
    areas = sprocket["areas"] if sprocket else []
    beta = [(2 * k - 1) * pi / teeth - pi / 2 for k in range(1, teeth + 1)]
    centre, along = (np.array([a[key] for a in areas]).reshape(-1, 2) for key in ("centre_m", "direction"))
    return Tooth(
        int(bool(areas)),
        *np.ascontiguousarray(centre.T), np.array([a["radius_m"] for a in areas]), *np.ascontiguousarray(along.T),
        np.array([cos(a["half_angle_rad"]) for a in areas]),
        np.array([a["kind"] == "convex" for a in areas], dtype=np.int64),
        np.array([cos(b) for b in beta]), np.array([sin(b) for b in beta]), teeth, tan(pi / teeth),
        sprocket["addendum_m"] if sprocket else 1.0, sprocket["connector_arc_m"] if sprocket else 0.03, law,
    )  # fmt: skip


def contacts_of(said: dict) -> Contacts:
    """What the independent formulation of the contacts takes (`replication.peers.contact`)."""
    model = model_of(said, "rk4", said["report"]["interval_s"])
    wheels, sprocket = model.wheels, said.get("sprocket")
    circle = np.column_stack([wheels.x, wheels.y, wheels.radius])
    laws = np.array([tuple(law) for law in (model.tooth.law, wheels.ring_law, wheels.wheel_law, wheels.wheel_law)])
    areas = (sprocket["areas"] if sprocket else [])[:5]
    arc = np.array([[*a["centre_m"], a["radius_m"], *a["direction"], a["half_angle_rad"]] for a in areas])
    sign = np.array([1.0 if a["kind"] == "convex" else -1.0 for a in areas])
    reach = sprocket["addendum_m"] + sprocket["connector_arc_m"] if sprocket else 0.0
    radius = sprocket["connector_arc_m"] if sprocket else said["link_half_thickness_m"]  # touches nothing then
    return Contacts(
        circle, laws, arc.reshape(-1, 6), sign, sprocket["teeth"] if sprocket else 0, reach, radius,
        said["link_half_thickness_m"],
    )  # fmt: skip


def state_of(said: dict, start: np.ndarray) -> State:
    """State of this simulator at the start of a problem; no contact has a memory yet."""
    chain = chain_of(said)
    n = len(chain.length)
    state = make_state(n, n // 2, 3 if "wheels" in said else 1)
    state.angle[:], state.rate[:] = start[:, 3], start[:, 6]
    c, s, half = cos(start[0, 3]), sin(start[0, 3]), chain.com_x[0]
    state.pin[:] = (
        start[0, 1] - half * c, start[0, 2] - half * s,
        start[0, 4] + half * s * start[0, 6], start[0, 5] - half * c * start[0, 6],
    )  # fmt: skip
    state.wheel_angle[SPROCKET] = said.get("drive", {}).get("start_angle_rad", 0.0)
    return state


if __name__ == "__main__":
    for each in NAMES:
        write_problem(each)
