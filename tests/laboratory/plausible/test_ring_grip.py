"""The study of the ring's tangential force: its laws, the verdicts of a row."""

import numpy as np
import pytest

from laboratory.plausible.grip import decided, laws
from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import load_plausible
from trackdyn.rig.rig import load_rig
from trackdyn.sweeps.engine import DONE, REFUSED

CONFIG = load_plausible("config/plausible.yaml")
RADII = CONFIG.grip.radii_m[115]
OF_FRICTION = ("friction_law", "friction_static", "friction_dynamic", "shear_stiffness", "transition_velocity")


def row(left, right, state=DONE):
    """A row of one start with these shares (% of a turn) by radius."""
    values = {
        scene_name(115, radius): {"left_share_pct": a, "right_share_pct": b, "mobilised_friction": radius}
        for radius, a, b in zip(RADII, left, right, strict=True)
    }
    return {"state": state, "values": {"starts": [values]}}


def test_laws_change_only_the_ring_and_one_value_of_it_at_a_time():
    rig, seen = load_rig("parts"), set()
    for friction in CONFIG.grip.laws:
        for setting, changes in laws(friction):
            changed = rig.changed(**changes)
            others = {name for name, field in changed.fields.items() if field.value != rig.fields[name].value}
            assert others <= {f"ring_contact.{name}" for name in OF_FRICTION}
            assert changed.ring_contact.friction_static == setting["friction_static"] == friction.friction
            seen.add(tuple(setting.items()))
    assert len(seen) == sum(len(friction.values) for friction in CONFIG.grip.laws)


# radii 0.304, 0.305, 0.307, 0.308, 0.309, 0.311, 0.313 m
@pytest.mark.parametrize(("left", "right", "expected"), [
    ([40, 20, 11.9, 8.1, 9, 10, 8], [3, 0.49, 0, 0, 0, 0, 0], (0.305, np.nan, np.nan, 1, 1)),
    ([40, 20, 12.1, 9, 9, 9, 9], [0.6, 0.5, 0, 0, 0, 0, 0], (0.307, np.nan, np.nan, 0, 0)),
    ([9, 8, 5, 0, 0.4, 0, 0], [0, 0, 0, 0, 0.5, 4, 9], (0.304, 0.309, 0.308, 0, 0)),
    ([40] * 7, [9] * 7, (np.nan, np.nan, np.nan, 0, 0)),
])  # fmt: skip
def test_row_decides_where_arcs_let_go_and_come_back(left, right, expected):
    """At most half a percent of a turn is no contact (C23), near 10 % is 8 to 12 (C25)."""
    values = decided(CONFIG, 115, row(left, right))
    names = ("right_free_from_m", "right_back_from_m", "left_lost_from_m", "conclusion_3", "plateau")
    np.testing.assert_equal([values[name] for name in names], expected)
    assert values["mobilised_friction"] == CONFIG.ring_radius_m  # of the paper's ring
    assert decided(CONFIG, 115, row(left, right, REFUSED)) == {}
