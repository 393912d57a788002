"""An integrator is one entry: set from outside it is chosen, limited and run."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from trackdyn.integrate.methods import METHODS

ROOT = Path(__file__).parents[2]
# as plain Python: the result matters, not how fast it is
WITH_ANOTHER = """
import json
from trackdyn import Loop, Scene, load_rig
from trackdyn.integrate.methods import METHODS
from trackdyn.scene.step import step_limits

METHODS["rk3"] = METHOD
rig = load_rig("paper").changed(chain__pitches=3, bushing__damping=0.5)
free = {"loop": "free", "ring_radius": None, "contact_log": False, "step": 2e-4}
scene = Scene(rig, 115.0, integrator="rk3", **free)
loop = Loop(scene)
loop.step(2)
rk4 = Scene(rig, 115.0, integrator="rk4", **free)
limits = [step_limits(s.model, 0.0, METHODS[s.integrator]) for s in (scene, rk4)]
print(json.dumps({
    "stages": len(loop.work.stages.b), "gap": loop.gap, "time": loop.time,
    "limits": limits, "reason": scene.fidelity["integrator"].setting,
}))
"""


def test_an_entry_from_outside_is_an_integrator():
    page = (ROOT / "docs" / "add-an-integrator.md").read_text(encoding="utf-8")
    source = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
    result = subprocess.run(
        [sys.executable, "-c", source + WITH_ANOTHER], cwd=ROOT, capture_output=True, text=True, check=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    output = json.loads(result.stdout)
    assert output["reason"] == "rk3" and output["stages"] == 3
    assert output["time"] == pytest.approx(4e-4) and output["gap"] < 1.1e-10
    rk3, rk4 = output["limits"]
    for cause, limit in rk3.items():
        reach = 2.51 / METHODS["rk4"].decay if "damping" in cause else 1.73 / METHODS["rk4"].oscillation
        assert limit / rk4[cause] == pytest.approx(reach, rel=1e-12)


def test_every_method_declares_what_its_order_needs():
    """Conditions of the orders 1 to 4 on a tableau; stages know only earlier ones."""
    for name, method in METHODS.items():
        assert method.order >= 1 and method.oscillation > 0 and method.decay > 0, name
        if method.tableau is None:
            continue
        a, b = np.array(method.tableau.a), np.array(method.tableau.b)
        c = a.sum(axis=1)
        assert not np.triu(a).any(), name
        conditions = {
            1: [(b.sum(), 1)],
            2: [(b @ c, 1 / 2)],
            3: [(b @ c**2, 1 / 3), (b @ a @ c, 1 / 6)],
            4: [(b @ c**3, 1 / 4), (b * c @ a @ c, 1 / 8), (b @ a @ c**2, 1 / 12), (b @ a @ a @ c, 1 / 24)],
        }
        for order in range(1, min(method.order, 4) + 1):
            for seen, expected in conditions[order]:
                assert seen == pytest.approx(expected, abs=1e-14), (name, order)
