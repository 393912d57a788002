"""The problems of the benchmark: data that need no knowledge of this simulator, and their files."""

import json
from pathlib import Path

import numpy as np

from trackdyn.errors import InputError, shown

FOLDER = Path(__file__).parent / "problems"
NAMES = ("free_chain", "ring", "teeth")
START_COLUMNS = ("body", "x_m", "y_m", "angle_rad", "vx_m_s", "vy_m_s", "omega_rad_s")


def read_problem(name: str) -> dict:
    """Statement of a problem: the contents of its JSON file, SI units."""
    if name not in NAMES:
        raise InputError(f"problem {shown(name)} does not exist; {', '.join(NAMES)} are accepted")
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def read_reference(name: str) -> tuple[dict, np.ndarray]:
    """Statistics and error bars of a reference solution, and its time series (structured array)."""
    table = np.genfromtxt(FOLDER / f"{name}_reference.csv", delimiter=",", names=True)
    return json.loads((FOLDER / f"{name}_reference.json").read_text(encoding="utf-8")), table


def read_start(name: str) -> np.ndarray:
    """Initial state (n, 7) of all bodies, columns ``START_COLUMNS``."""
    return np.loadtxt(FOLDER / f"{name}_start.csv", delimiter=",", skiprows=1)
