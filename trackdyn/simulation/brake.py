"""What the brake of a load does in a record: whether the wheel turns that it brakes, and how far the chain slips."""

from math import pi

import numpy as np

from trackdyn.chain.kinematics import SLOW
from trackdyn.inputs.errors import InputError
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import wheel_names
from trackdyn.scene.scene import BRAKES_FROM, Scene

# Share of a load that the brake of a turning wheel holds at least: it has 99.5 % of its torque at `BRAKES_FROM`, and a
# wheel that slows down for a moment makes up for it; one that stands holds what friction does.
HELD = 0.95


def braked_rates(scene: Scene, wheel_rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rates of the braked wheel, rad/s, and those with which the chain would turn it if it did not slip.

    ``wheel_rate`` is (s, w), rad/s, that of the sprocket first; samples in which the brake fades are left out.
    """
    motor_rpm = np.abs(wheel_rate[:, SPROCKET]) * scene.rig.sprocket.transmission_ratio * 60 / (2 * pi)
    rolling = motor_rpm * scene.braked_rate
    driven = rolling >= BRAKES_FROM
    return np.abs(wheel_rate[driven, scene.braked_wheel[0]]), rolling[driven]


def check_load(scene: Scene, wheel_rate: np.ndarray) -> None:
    """Raise `InputError` if the wheel that a load brakes stands under the chain: it pulls less than the load then."""
    if not scene.load:
        return
    rates, rolling = braked_rates(scene, wheel_rate)
    held = float(np.tanh(rates / SLOW).mean()) if len(rates) else 1.0
    if held >= HELD:
        return
    name = wheel_names(scene.rig)[scene.braked_wheel[0]]
    raise InputError(
        f"scene: load = {scene.load:g} N: friction holds {held * scene.load:.3g} N of it, the chain slides over the "
        f"{name}, which turns at {rates.mean():.2g} rad/s where the chain would turn it at {rolling.mean():.2g}; use "
        f"less load, more tension.pre_tension or more {scene.rig.wheels[name].surface}.friction_static"
    )


def slip(scene: Scene, wheel_rate: np.ndarray) -> float:
    """Return the share of the chain's speed by which it slips on the wheel that a load brakes; NaN at rest."""
    rates, rolling = braked_rates(scene, wheel_rate)
    return float(1.0 - rates.sum() / rolling.sum()) if len(rates) else float("nan")
