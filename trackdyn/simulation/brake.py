"""Brake of a load in a record: rates of the braked wheel, slip of the chain on it."""

from math import pi

import numpy as np

from trackdyn.chain.kinematics import SLOW
from trackdyn.inputs.errors import InputError
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import wheel_names
from trackdyn.scene.scene import BRAKES_FROM, Scene

# Least share of a load that the brake of a turning wheel transmits. It has 99.5 % of its torque at `BRAKES_FROM`; the
# rest is for moments at which the wheel slows down. A wheel at rest transmits only the friction of the chain.
HELD = 0.95


def braked_rates(scene: Scene, wheel_rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rates of the braked wheel in a record, and those with which the chain would turn it without slip."""
    motor_rpm = np.abs(wheel_rate[:, SPROCKET]) * scene.rig.sprocket.transmission_ratio * 60 / (2 * pi)
    rolling = motor_rpm * scene.braked_rate
    driven = rolling >= BRAKES_FROM  # below it the brake fades
    return np.abs(wheel_rate[driven, scene.braked_wheel[0]]), rolling[driven]


def check_load(scene: Scene, wheel_rate: np.ndarray) -> None:
    """Raise `InputError` if the chain slides over the braked wheel, which then pulls less than the load."""
    if not scene.load:
        return
    rates, rolling = braked_rates(scene, wheel_rate)
    if not len(rates) or (held := float(np.tanh(rates / SLOW).mean())) >= HELD:
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
