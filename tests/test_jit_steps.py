"""Every kernel of the time loop does the same compiled as interpreted, over ten steps."""

import pickle

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured

from tests.conftest import LAWS, python
from trackdyn.simulation.loop import Loop

# together they run every kernel
SCENES = {
    "default": {}, "compliant cut": {"closure": "elastic_damping"}, "every link": {"every_link": True},
    "single pin": {"chain": "single_pin", "ring_radius": None}, "sprung": {"tension": "sprung", **LAWS},
    "coulomb": {"drag": "coulomb", "tooth_contact": "three_surfaces"}, "rk4": {"integrator": "rk4", **LAWS},
    "linearly implicit": {"integrator": "linearly_implicit", **LAWS},
    "spatial": {"space": "spatial", "tension": "locked", **LAWS},
}  # fmt: skip
DAHL = {"rig": {"ring_contact__friction_law": "dahl", "ring_contact__shear_stiffness": 5e4}}
SCENES |= {f"dahl {name}": SCENES[name] | DAHL for name in ("default", "linearly implicit")}
TEN_STEPS = """
import functools, pickle, sys
from pathlib import Path
import numpy as np
from trackdyn import jit

if jit.INTERPRETED:
    kernels, called = set(), set()
    def made(function, **options):
        kernels.add(function.__qualname__)
        @functools.wraps(function)
        def counted(*arguments):
            called.add(function.__qualname__)
            return function(*arguments)
        counted.py_func = function
        return counted
    jit._made = made
from trackdyn.simulation.loop_arrays import flatten

for path in Path(sys.argv[1]).glob("*.loop"):
    loop = pickle.loads(path.read_bytes())
    samples = -(-10 // loop.model.stride)
    recording = loop.record(samples / loop.scene.rig.rate, every_link=loop.scene.every_link)
    arrays = flatten(loop.state, "state") | flatten(loop.work, "work")
    arrays |= {name: getattr(recording, name) for name in recording.ARRAYS if getattr(recording, name) is not None}
    np.savez(path.with_suffix(sys.argv[2]), **arrays)
if jit.INTERPRETED:
    print(*sorted(kernels - called))
"""


def read(path):
    """Arrays of numbers of a file, those of rows with named columns as a table."""
    with np.load(path) as data:
        return {name: structured_to_unstructured(data[name]) if data[name].dtype.names else data[name] for name in data}


def test_ten_steps_are_those_of_the_interpreted_kernels(make_scene, rig, tmp_path):
    """Only the order of rounding may differ; one step would not show state that a kernel loses from step to step."""
    for name, fields in SCENES.items():
        loop = Loop(make_scene(150.0, **(fields | {"rig": rig.changed(**fields.get("rig", {}))})))
        loop.advance(0.3)
        loop.arrays.work.candidates.groove[:] = 0  # grooves are searched anew
        if loop.state.plane is not None:
            loop.arrays.state.plane.motion[:2] = 0.0055, 0.1  # beyond the play of the guides, m and m/s
        (tmp_path / f"{name}.loop").write_bytes(pickle.dumps(loop))
    python(TEN_STEPS, tmp_path, ".compiled")
    never_called = python(TEN_STEPS, tmp_path, ".interpreted", NUMBA_DISABLE_JIT="1").out.split()
    assert never_called == ["_first_beyond"], "which looks for the body where a run diverged"
    for name in SCENES:
        compiled, interpreted = (read(tmp_path / f"{name}.{kind}.npz") for kind in ("compiled", "interpreted"))
        assert interpreted["work.tooth_force"].max() > 100.0
        for array, right in interpreted.items():
            # accelerations are small differences of large loads
            error = 1e-7 if array in ("work.alpha", "work.pin_ax", "work.pin_ay") else 1e-8
            atol = error * np.nanmax(np.abs(right), initial=0.1)
            np.testing.assert_allclose(compiled[array], right, rtol=0, atol=atol, err_msg=f"{name}: {array}")
