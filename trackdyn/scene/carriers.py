"""Carriers of a rig's wheels, and the tensioner that is let go on its spring, as kernels see them."""

from math import cos, radians, sin

import numpy as np

from trackdyn.errors import InputError
from trackdyn.integrate.carriers import along, push
from trackdyn.model.constants import Carriers, Model
from trackdyn.model.state import SLIDE
from trackdyn.model.work import Work
from trackdyn.parameters.layout import tensioner, wheel_names
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.wheels import Arm

CARRIED = ("sprung", "forced")  # how a tensioner that moves while the chain runs is kept


def make_carriers(rig: Rig, model: Model, kept: str, shift: float) -> Carriers | None:
    """Carriers at rest where the model's wheels stand, their springs without preload; None if all wheels are fixed.

    ``kept`` is the scene's tension: with `CARRIED` the tensioning wheel, shifted by ``shift`` (m), is one of them.
    """
    rows, force = [], None
    for k, name in enumerate(wheel_names(rig)):
        at_x, at_y = float(model.wheels.x[k]), float(model.wheels.y[k])
        if k == tensioner(rig) and kept in CARRIED:
            t, direction = rig.tension, radians(rig.tension.direction)
            spring = (t.stiffness, t.damping) if kept == "sprung" else (0.0, t.damping)
            if kept == "forced":
                force = np.array(t.force, dtype=float)
            rows.append(
                (
                    k,
                    0,
                    at_x,
                    at_y,
                    cos(direction),
                    sin(direction),
                    t.mass,
                    *spring,
                    0.0,
                    -t.travel - shift,
                    t.travel - shift,
                )
            )
        elif k and (carrier := rig.rollers[name].carrier) is not None:
            if isinstance(carrier, Arm):
                dx, dy, travel = at_x - carrier.x, at_y - carrier.y, radians(carrier.travel)
                inertia, lifted = carrier.mass * (dx**2 + dy**2), carrier.mass * rig.gravity
                rows.append(
                    (
                        k,
                        1,
                        carrier.x,
                        carrier.y,
                        -dy,
                        dx,
                        inertia,
                        carrier.stiffness,
                        carrier.damping,
                        lifted,
                        -travel,
                        travel,
                    )
                )
            else:
                direction, travel = radians(carrier.direction), carrier.travel
                ends = -travel, travel
                rows.append(
                    (
                        k,
                        0,
                        at_x,
                        at_y,
                        cos(direction),
                        sin(direction),
                        carrier.mass,
                        carrier.stiffness,
                        carrier.damping,
                        0.0,
                        *ends,
                    )
                )
    if not rows:
        return None
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    wheel, arm, x, y, along_x, along_y, mass, stiffness, damping, weight, low, high = columns
    of_wheel = np.full(len(model.wheels.x), -1)
    of_wheel[wheel] = np.arange(len(wheel))
    number = int(of_wheel[tensioner(rig)])
    return Carriers(
        wheel,
        of_wheel,
        arm,
        x,
        y,
        along_x,
        along_y,
        mass,
        stiffness,
        damping,
        np.zeros(len(rows)),
        weight,
        low,
        high,
        number,
        force,
    )


def preloads(rig: Rig, carriers: Carriers, work: Work, q: np.ndarray) -> np.ndarray:
    """(k,) preloads that hold the chain as it lies with the carriers at ``q``, or those that the rig gives.

    Raises
    ------
    InputError
        A spring could not hold what lies on it within its travel.
    """
    names, found = wheel_names(rig), np.zeros(len(carriers.wheel))
    for k, wheel in enumerate(carriers.wheel):
        forced = carriers.force is not None and k == carriers.tensioner
        carrier = None if wheel == tensioner(rig) else rig.rollers[names[wheel]].carrier
        tx, ty = along(carriers, k, float(q[k]))
        fx, fy = push(work, wheel)
        if forced:
            continue
        if carrier is None or carrier.preload is None:
            found[k] = carriers.stiffness[k] * q[k] - (tx * fx + ty * fy) + carriers.weight[k] * ty
        else:
            slid = 0.0 if isinstance(carrier, Arm) else carrier.mass * rig.gravity * ty
            found[k] = carrier.preload - slid
    return found


def refuse_stops(rig: Rig, carriers: Carriers | None, slide: np.ndarray | None) -> None:
    """Refuse a loop that has settled with a carrier at a stop: its spring holds nothing there.

    Raises
    ------
    InputError
        Which wheel, and what to change.
    """
    if carriers is None or slide is None:
        return
    for k, wheel in enumerate(carriers.wheel):
        q, name = float(slide[k, SLIDE]), wheel_names(rig)[wheel]
        if not carriers.low[k] < q < carriers.high[k]:
            kind = "tension" if wheel == tensioner(rig) else f"{name}.{'arm' if carriers.arm[k] else 'slider'}"
            raise InputError(
                f"{kind}.travel: wheel {name} rests on a stop of its "
                f"{'arm' if carriers.arm[k] else 'slider'} once the loop has settled; "
                "change the preload or force, stiffen the spring or allow more travel"
            )
