"""Carriers of a rig's wheels, and the tensioner that is let go on its spring, as kernels see them."""

from math import cos, radians, sin

import numpy as np

from trackdyn.errors import InputError
from trackdyn.integrate.carriers import along, push
from trackdyn.model.constants import SPROCKET, Carriers, Model
from trackdyn.model.state import SLIDE
from trackdyn.model.work import Work
from trackdyn.parameters.layout import tensioner, wheel_names
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.sections import Tension
from trackdyn.parameters.wheels import Arm

# fields of a row of carriers, and those that are integers
ROW = ("wheel", "arm", "x", "y", "along_x", "along_y", "mass", "stiffness", "damping", "weight", "low", "high")
INTEGER, NO_FORCE = {"wheel": int, "arm": int}, np.empty((0, 2))
CARRIED = ("sprung", "forced")  # how a tensioner that moves while the chain runs is kept


def make_carriers(rig: Rig, model: Model, kept: str, shift: float) -> Carriers:
    """Carriers at rest where the model's wheels stand, their springs without preload.

    ``kept`` is the scene's tension: with `CARRIED` the tensioning wheel, shifted by ``shift`` (m), is one of them.
    """
    rows, force = [], NO_FORCE
    for k, name in enumerate(wheel_names(rig)):
        x, y = float(model.wheels.x[k]), float(model.wheels.y[k])
        tensions = k == tensioner(rig) and kept in CARRIED
        carrier = rig.tension if tensions else rig.rollers[name].carrier if k else None
        if carrier is None:
            continue
        row = {"wheel": k, "arm": 0, "x": x, "y": y, "mass": carrier.mass, "weight": 0.0}
        row |= {"stiffness": carrier.stiffness, "damping": carrier.damping, "low": -carrier.travel}
        row["high"] = carrier.travel
        if isinstance(carrier, Arm):
            dx, dy, travel = x - carrier.x, y - carrier.y, radians(carrier.travel)
            row |= {"arm": 1, "x": carrier.x, "y": carrier.y, "along_x": -dy, "along_y": dx, "low": -travel}
            row |= {"mass": carrier.mass * (dx**2 + dy**2), "weight": carrier.mass * rig.gravity, "high": travel}
        else:
            direction = radians(carrier.direction)
            row |= {"along_x": cos(direction), "along_y": sin(direction)}
        if tensions:
            row |= {"low": -carrier.travel - shift, "high": carrier.travel - shift}
            if kept == "forced" and isinstance(carrier, Tension):
                row["stiffness"], force = 0.0, np.array(carrier.force, dtype=float)
        rows.append(row)
    return carriers_of(rows, len(model.wheels.x), tensioner(rig), force)


def carriers_of(rows: list[dict], wheels: int, tensions: int = SPROCKET, force: np.ndarray = NO_FORCE) -> Carriers:
    """Carriers from a row of fields each, without preload; ``tensions`` is the wheel that ``force`` pushes."""
    columns = {name: np.array([row[name] for row in rows], INTEGER.get(name, float)) for name in ROW}
    of_wheel = np.full(wheels, -1)
    of_wheel[columns["wheel"]] = np.arange(len(rows))
    return Carriers(
        **columns, of_wheel=of_wheel, preload=np.zeros(len(rows)), tensioner=int(of_wheel[tensions]), force=force
    )


def preloads(rig: Rig, carriers: Carriers, work: Work, q: np.ndarray) -> np.ndarray:
    """(k,) preloads that hold the chain with the carriers at ``q``, or the rig's; `InputError` beyond their travel."""
    names, found = wheel_names(rig), np.zeros(len(carriers.wheel))
    for k, wheel in enumerate(carriers.wheel):
        if len(carriers.force) and k == carriers.tensioner:  # its force is prescribed
            continue
        carrier = None if wheel == tensioner(rig) else rig.rollers[names[wheel]].carrier
        tx, ty = along(carriers, k, float(q[k]))
        fx, fy = push(work, wheel)
        if carrier is None or carrier.preload is None:
            found[k] = carriers.stiffness[k] * q[k] - (tx * fx + ty * fy) + carriers.weight[k] * ty
        else:
            slid = 0.0 if isinstance(carrier, Arm) else carrier.mass * rig.gravity * ty
            found[k] = carrier.preload - slid
    return found


def refuse_stops(rig: Rig, carriers: Carriers, slide: np.ndarray) -> None:
    """Refuse (`InputError`) a loop that has settled with a carrier at a stop: its spring holds nothing there."""
    for k, wheel in enumerate(carriers.wheel):
        q, name = float(slide[k, SLIDE]), wheel_names(rig)[wheel]
        if not carriers.low[k] < q < carriers.high[k]:
            kind = "tension" if wheel == tensioner(rig) else f"{name}.{'arm' if carriers.arm[k] else 'slider'}"
            raise InputError(
                f"{kind}.travel: wheel {name} rests on a stop of its {'arm' if carriers.arm[k] else 'slider'} once the "
                "loop has settled; change the preload or force, stiffen the spring or allow more travel"
            )
