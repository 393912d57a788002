"""What of a recording depends on the processor: the same scenes under other instruction sets, compared byte by byte.

    python benchmarks/processors.py

Other processors are imitated by what the libraries let choose: the target of numba (``NUMBA_CPU_NAME``), the kernels
of OpenBLAS, those of numpy, the number of threads, and, with glibc, the variants of sin, cos and atan2. Every variant
runs in its own process.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

# name -> (motor speed, ring radius, duration)
SCENES = {"ring 0.308 m, 115 rpm, 2 s": (115.0, 0.308, 2.0), "no ring, 210 rpm, 3 s": (210.0, None, 3.0)}
BASE = {"OPENBLAS_NUM_THREADS": "1"}
VARIANTS = {
    "again": {},
    "two threads": {"OPENBLAS_NUM_THREADS": "2"},
    "numba generic": {"NUMBA_CPU_NAME": "generic"},
    "numba haswell": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma,+bmi,+bmi2"},
    "OpenBLAS Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "OpenBLAS Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "OpenBLAS SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "numpy without AVX": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL"},
    "glibc without FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"},
}
RUN = """
import sys
from trackdyn import Scene, load_rig, simulate
radius = None if sys.argv[3] == "None" else float(sys.argv[3])
scene = Scene(load_rig(sys.argv[1]), float(sys.argv[2]), ring_radius=radius, duration=float(sys.argv[4]))
simulate(scene).save(sys.argv[5])
"""


def record(rig, scene, path, environment):
    """Arrays of a recording made in its own process."""
    subprocess.run(
        [sys.executable, "-c", RUN, str(rig), *map(str, scene), str(path)],
        check=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | BASE | environment,
    )
    with np.load(path) as data:
        return {name: data[name] for name in data.files if name != "meta"}


def difference(reference, other):
    """In words: equal bytes, or how far apart signal and its root mean square are, relative to the latter."""
    unequal = [name for name in reference if reference[name].tobytes() != other[name].tobytes()]
    if not unequal:
        return "every byte equal"
    a, b = (each["mean"][:, :2] for each in (reference, other))
    a, b = (np.linalg.norm(each - each.mean(axis=0), axis=1) for each in (a, b))
    rms = np.sqrt(np.mean(a**2))
    apart = np.abs(b - a) / rms
    grown = np.flatnonzero(apart > 1e-3)
    when = f", 1e-3 after {reference['time'][grown[0]]:.2f} s" if len(grown) else ""
    return (
        f"{len(unequal)} of {len(reference)} arrays differ; acceleration: first sample {apart[0]:.0e}, largest "
        f"{apart.max():.0e}{when}; RMS {abs(np.sqrt(np.mean(b**2)) / rms - 1.0):.0e}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", type=Path, default=ROOT / "config" / "rigs" / "paper.yaml")
    rig = parser.parse_args().rig
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.npz"
        for name, scene in SCENES.items():
            reference = record(rig, scene, path, {})
            print(name, flush=True)
            for variant, environment in VARIANTS.items():
                print(f"  {variant:20s}{difference(reference, record(rig, scene, path, environment))}", flush=True)


if __name__ == "__main__":
    main()
