"""docs/equations.csv is complete: every equation has a row, every function and every test in it exists."""

import ast
import importlib
import re
from functools import reduce

import numpy as np
import pandas as pd
import pytest

from tests.conftest import ROOT
from tests.kinematics import pins, without_extrapolation
from trackdyn.contact.laws import elastic_force, find_area, groove_index
from trackdyn.integrate.run import refresh
from trackdyn.model.constants import SPROCKET
from trackdyn.simulation.signals import specific_force

TABLE = pd.read_csv(ROOT / "docs" / "equations.csv", keep_default_na=False)
STATUS = ("printed", "reconstructed", "corrected", "replaced")
FUNCTIONS, TESTS = (sorted(set(" ".join(TABLE[column]).split())) for column in ("functions", "tests"))


def test_every_equation_of_the_paper_has_exactly_one_row():
    spans = [tuple(map(int, cell.split("-"))) for cell in TABLE["equation"] if cell]
    assert [number for span in spans for number in range(span[0], span[-1] + 1)] == list(range(1, 41))


def test_every_row_names_functions_and_tests_that_exist():
    assert (TABLE[["what", "functions", "tests", "status"]] != "").all(axis=None)
    for status in TABLE.loc[TABLE["equation"] != "", "status"]:
        assert status.startswith(STATUS) and (status.startswith("printed") or re.search(r"[:;,] \S", status)), status
    for name in FUNCTIONS:
        module, _, path = name.partition(":")
        assert callable(reduce(getattr, path.split("."), importlib.import_module(module))), name
    for name in TESTS:
        path, _, function = name.partition("::")
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, name


def depth_after(model, state, arc, seconds):
    """Area, depth and R of an arc when everything goes on with its present velocity (Eqs. 12 to 29, 33)."""
    chain, tooth, wheels = model.chain, model.tooth, model.wheels
    later = state._replace(pin=state.pin[:2] + seconds * state.pin[2:], angle=state.angle + seconds * state.rate)
    x, y = pins(chain, later)[arc + 1] - [wheels.x[SPROCKET], wheels.y[SPROCKET]]
    point = (x + 1j * y) * np.exp(-1j * (state.wheel_angle[SPROCKET] + seconds * state.wheel_rate[SPROCKET]))
    k = groove_index(tooth.teeth, point.real, point.imag)
    point *= np.exp(1j * (np.pi / 2 - (2 * k - 1) * np.pi / tooth.teeth))
    area, depth, _, _, radius = find_area(tooth, point.real, point.imag)
    return area, depth, radius


def test_penetration_velocity_on_a_tooth_is_the_rate_of_the_depth(driven_loop):
    """Central difference of the depth against the velocity that the damping force and its memory show."""
    model, state, work, _ = driven_loop(None).arrays
    law = model.tooth.law._replace(speed_floor=1e-12, loss=0.25)
    model = without_extrapolation(model._replace(tooth=model.tooth._replace(law=law)), work)
    state.rate[:] += np.random.default_rng(1).normal(0.0, 1.0, len(state.rate))
    start, h, seen = state.wheel_angle[SPROCKET], 1e-6, dict.fromkeys(range(1, 11), 0)
    # other angles of the sprocket bring other areas into contact
    for offset in np.linspace(0.0, 2 * np.pi / model.tooth.teeth, 12, endpoint=False):
        state.wheel_angle[SPROCKET] = start + offset
        state.tooth_impact[:] = 0.0
        refresh(model, state, work)
        for arc in range(len(work.tooth_force)):
            before, (area, depth, radius), after = (depth_after(model, state, arc, time) for time in (-h, 0.0, h))
            assert area == work.tooth_area[arc]  # Eq. 18 saves time and loses no contact
            # at a joint of two areas the difference would be one across it
            if work.tooth_force[arc] == 0.0 or not before[0] == area == after[0]:
                continue
            # a contact that begins now stores its velocity, and its bracket is 1 + loss or 1 - loss
            sign = np.sign(work.tooth_force[arc] / elastic_force(law, depth, radius)[0] - 1)
            rate = (after[1] - before[1]) / (2 * h)
            # rounding of the depth, 1e-16 m / 2e-6 s, and the third derivative of the path times 1e-12 s2
            assert sign * state.tooth_impact[arc] == pytest.approx(rate, abs=3e-9 + 1e-8 * abs(rate))
            seen[area] += abs(rate) > 1e-6
    # convex (Eq. 30) and concave (Eq. 34), left and right
    assert all(any(seen[area] for area in kind) for kind in ((1, 4), (2, 3, 5), (7, 10), (6, 8, 9))), seen


def test_sensor_shows_gravity_at_rest_and_nothing_in_free_fall():
    angle = np.linspace(-3.0, 3.0, 13)
    upwards = 9.81 * np.column_stack([np.sin(angle), np.cos(angle)])  # in the axes of a link turned counter-clockwise
    np.testing.assert_allclose(specific_force(np.zeros((13, 2)), angle), upwards, rtol=0, atol=1e-14)
    np.testing.assert_allclose(specific_force(-upwards, angle), 0.0, rtol=0, atol=1e-14)
