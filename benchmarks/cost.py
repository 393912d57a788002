"""Measure the costs of the simulator: time per simulated second and per body and step, memory, compilation.

    python benchmarks/cost.py --out results/benchmarks/cost.json

Medians over repeats are reported together with the fastest and the slowest one, because other work on
the machine can only slow a repeat down. Compilation is measured apart, in a process with an empty cache.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
# One core: the thread pools of the linear algebra libraries must not help.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(ROOT))

SPEEDS_RPM = (115.0, 210.0)
RING_RADIUS_M = 0.308
STEP_S = 1e-4
SIMULATED_S = 5.0  # of every repeat
STEADY_AFTER_S = 2.0
MEMORY_RECORD_S = 90.0
PITCHES = (35, 70, 175, 350, 700, 1750, 3500)
LOOP_PITCHES = (63, 125, 250, 500, 1000)
BODY_STEPS = 2_000_000  # of a repeat of the chain solver: a few tenths of a second

COMPILE = """
import json, sys, time
begin = time.perf_counter()
from trackdyn import Scene, load_rig, simulate
imported = time.perf_counter()
simulate(Scene(load_rig(sys.argv[1]), 115.0, duration=0.001, lead_in=0.0, ramp=0.001))
print(json.dumps({"import_s": imported - begin, "first_run_s": time.perf_counter() - imported}))
"""

MEMORY = """
import json, resource, sys
from trackdyn import Scene, load_rig, simulate
unit = 1 if sys.platform == "darwin" else 1024  # ru_maxrss is in bytes there, in KiB elsewhere
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
rig = load_rig(sys.argv[1])
simulate(Scene(rig, 115.0, duration=0.001, lead_in=0.0, ramp=0.001))
short = peak()
recording = simulate(Scene(rig, 115.0, duration=float(sys.argv[2])))
arrays = sum(getattr(getattr(recording, name), "nbytes", 0) for name in recording.ARRAYS) / 1e6
result = {"record_s": float(sys.argv[2]), "peak_mb": peak(), "peak_before_mb": short, "arrays_mb": arrays}
print(json.dumps(result))
"""


def summary(values) -> dict:
    """Return median, fastest and slowest of the repeats."""
    middle = statistics.median(values)
    return {"median": middle, "min": min(values), "max": max(values), "repeats": len(values)}


def in_subprocess(code: str, *arguments: str, **environment: str) -> dict:
    """Run a piece of code in its own process and read the JSON object that it prints last."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    result = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": path} | environment,
    )
    return json.loads(result.stdout.splitlines()[-1])


def compilation(rig_path: Path) -> dict:
    """Measure the seconds of import and first run with an empty and with a filled kernel cache."""
    with tempfile.TemporaryDirectory() as cache:
        cold = in_subprocess(COMPILE, str(rig_path), TRACKDYN_CACHE=cache)
        warm = in_subprocess(COMPILE, str(rig_path), TRACKDYN_CACHE=cache)
    return {
        "empty_cache": cold,
        "filled_cache": warm,
        "compile_s": cold["first_run_s"] - warm["first_run_s"],
    }


def simulated_second(rig, repeats: int) -> list[dict]:
    """Wall seconds of one core for a simulated second at steady running.

    Every scene is settled and started once; a repeat goes on from there for ``SIMULATED_S``.
    """
    from trackdyn import Loop, Scene
    from trackdyn.simulation.recorder import Recorder

    rows = []
    for rpm in SPEEDS_RPM:
        for radius in (RING_RADIUS_M, None):
            loop = Loop(Scene(rig, rpm, ring_radius=radius, step=STEP_S))
            loop.advance(loop.scene.ramp + STEADY_AFTER_S)
            for contact_log in (True, False):
                walls, piece = [], loop.scene.with_(duration=SIMULATED_S, contact_log=contact_log)
                for _ in range(repeats):
                    begin = time.perf_counter()
                    Recorder(loop, piece, checked=False).finish()
                    walls.append((time.perf_counter() - begin) / SIMULATED_S)
                wall = summary(walls)
                rows.append(
                    {
                        "motor_rpm": rpm,
                        "ring_radius_m": radius,
                        "step_s": STEP_S,
                        "contact_log": contact_log,
                        "simulated_s_a_repeat": SIMULATED_S,
                        "wall_s_per_simulated_s": wall,
                        "us_per_step": wall["median"] * STEP_S * 1e6,
                    }
                )
                print(
                    f"{rpm:g} rpm, ring {radius}, contact log {contact_log}: {wall['median']:.4f} s "
                    f"({wall['min']:.4f} to {wall['max']:.4f}) a simulated second"
                )
    return rows


# features that a scene may omit or add: the cost of each is the difference from the plain scene
FEATURES = {
    "plain": {},
    "no contact log": {"contact_log": False},
    "no teeth": {"tooth_contact": "none"},
    "no ring": {"ring_radius": None},
    "three surfaces": {"tooth_contact": "three_surfaces"},
    "no friction": {"friction": "none"},
    "elastic contact": {"normal_law": "elastic"},
    "compliant cut": {"closure": "elastic_damping"},
    "one body per pitch": {"chain": "single_pin"},
    "3D motion": {"space": "spatial"},
    "linearly implicit": {"integrator": "linearly_implicit"},
    "RK4": {"integrator": "rk4", "step": 5e-5},
}


def features(rig, repeats: int) -> list[dict]:
    """Measure the cost of a step with and without each feature, the scenes in turn so that all share the noise."""
    from trackdyn import Loop, Scene
    from trackdyn.simulation.recorder import Recorder

    samples = round(0.2 * rig.rate)
    runs, walls = {}, {name: [] for name in FEATURES}
    for name, fields in FEATURES.items():
        # a tensioner that every feature can have
        same = {"motor_rpm": 150.0, "ring_radius": RING_RADIUS_M, "step": STEP_S, "tension": "locked"}
        loop = Loop(Scene(rig, **(same | fields)))
        loop.advance(loop.scene.ramp + 1.0)
        runs[name] = loop
    for _ in range(repeats):
        for name, loop in runs.items():
            begin = time.perf_counter()
            Recorder(loop, loop.scene.with_(duration=samples / rig.rate), checked=False).finish()
            walls[name].append((time.perf_counter() - begin) / samples / loop.model.stride * 1e6)
    plain = statistics.median(walls["plain"])
    rows = []
    for name, values in walls.items():
        cost = summary(values)
        ratio = statistics.median(a / b for a, b in zip(values, walls["plain"], strict=True))
        rows.append({"feature": name, "us_per_step": cost, "difference_us": cost["median"] - plain, "ratio": ratio})
        print(
            f"{name:>18}: {cost['median']:.2f} us a step, {cost['median'] - plain:+.2f} us, "
            f"{ratio:.2f} times the plain scene"
        )
    return rows


def chain_alone(rig, repeats: int) -> list[dict]:
    """Measure microseconds per body and call of the Riccati sweep, from one loop of the rig to a hundred times that.

    The bodies lie on a regular polygon, clockwise and closed, so that the closure is well posed at any size.
    """
    import numba
    import numpy as np

    from trackdyn.chain.riccati import accelerations
    from trackdyn.model.arrays import make_state, make_work
    from trackdyn.scene.build import build_chain

    @numba.njit
    def repeat(calls, chain, state, work, damping):
        # called from Python one by one, short chains would show the price of the call
        for _ in range(calls):
            accelerations(chain, state, work, damping)

    rows = []
    for pitches in PITCHES:
        chain = build_chain(rig.changed(chain__pitches=pitches))
        n = len(chain.length)
        state, work = make_state(n, 1, 1), make_work(n, 1, 1)
        state.angle[:] = -2 * np.pi * np.arange(n) / n
        work.cos[:], work.sin[:] = np.cos(state.angle), np.sin(state.angle)
        rng = np.random.default_rng(1)
        state.rate[:] = rng.normal(0.0, 1.0, n)
        work.force_x[:], work.force_y[:], work.moment[:] = rng.normal(0.0, 100.0, (3, n))
        work.torque[:] = rng.normal(0.0, 1.0, n)
        arguments = (chain, state, work, STEP_S * chain.damping)
        repeat(1, *arguments)
        calls = max(BODY_STEPS // n, 1)
        values = []
        for _ in range(repeats):
            begin = time.perf_counter()
            repeat(calls, *arguments)
            values.append((time.perf_counter() - begin) / calls / n * 1e6)
        if not np.isfinite(work.sweep.response).all():
            raise SystemExit(f"the chain of {n} bodies has no finite accelerations; its cost means nothing")
        rows.append({"bodies": n, "calls_a_repeat": calls, "us_per_body_and_step": summary(values)})
        print(f"{n} bodies: {rows[-1]['us_per_body_and_step']['median']:.4f} us a body and step")
    return rows


def long_loops(repeats: int) -> list[dict]:
    """Measure nanoseconds of CPU time per body and step, of the two-wheel bench with more and more pitches.

    Hardly any weight, so that strands of up to 78 m stand off the ground; wheels and contacts stay the same, so their
    share falls.
    """
    from trackdyn import Loop, Scene, load_rig

    bench = load_rig("bench").changed(gravity=0.05, tension__travel=0.5)
    pitch = bench.chain.link_length + bench.connector_length
    rows = []
    for pitches in LOOP_PITCHES:
        out = 0.5 * (pitches - bench.chain.pitches) * pitch
        rig = bench.changed(chain__pitches=pitches, idler__x=bench.wheels["idler"].x - out)
        loop = Loop(Scene(rig, 20.0 * rig.sprocket.transmission_ratio, step=5e-5, contact_log=False))
        loop.advance(0.1)
        steps = max(BODY_STEPS // loop.scene.bodies, 1)
        values = []
        for _ in range(repeats):
            begin = time.process_time()
            loop.advance(steps * loop.model.step)
            values.append((time.process_time() - begin) / steps / loop.scene.bodies * 1e9)
        rows.append(
            {
                "pitches": pitches,
                "bodies": loop.scene.bodies,
                "steps_a_repeat": steps,
                "ns_per_body_and_step": summary(values),
            }
        )
        print(
            f"loop of {pitches} pitches: {rows[-1]['ns_per_body_and_step']['median']:.1f} ns a body "
            f"and step, gap {loop.gap:.1e} m"
        )
    return rows


def cpu_model() -> str:
    """Return the name of the processor as the system gives it."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def machine() -> dict:
    """Return the machine, packages and sources of the measurement."""
    from trackdyn.jit import source_hash

    return {
        "platform": platform.platform(),
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg() if hasattr(os, "getloadavg") else None,
        "python": platform.python_version(),
        "versions": {name: version(name) for name in ("numpy", "numba", "scipy")},
        "sources": source_hash(),
    }


def main() -> None:
    """Measure, print and store the costs."""
    parser = argparse.ArgumentParser(description="Measure the cost of the simulator and write it as JSON.")
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/cost.json"), help="file to write")
    parser.add_argument("--repeats", type=int, default=5, help="repeats of every timing (default 5)")
    arguments = parser.parse_args()
    if arguments.repeats < 1:
        parser.error(f"--repeats = {arguments.repeats}: must be at least 1")

    from trackdyn.inputs.files import write_text
    from trackdyn.rig.rig import load_rig

    rig_path = ROOT / "trackdyn" / "rigs" / "paper.yaml"
    rig = load_rig(rig_path)
    result = {"machine": machine(), "compilation": compilation(rig_path)}
    print(f"compilation: {result['compilation']['compile_s']:.1f} s, once for every version of the sources")
    result["simulated_second"] = simulated_second(rig, arguments.repeats)
    result["features"] = features(rig, arguments.repeats)
    result["chain_alone"] = chain_alone(rig, arguments.repeats)
    result["long_loops"] = long_loops(arguments.repeats)
    result["memory"] = in_subprocess(MEMORY, str(rig_path), str(MEMORY_RECORD_S))
    print(f"peak memory of a {MEMORY_RECORD_S:g} s record: {result['memory']['peak_mb']:.0f} MB")
    result["machine"]["load_average_after"] = os.getloadavg() if hasattr(os, "getloadavg") else None
    write_text(arguments.out, json.dumps(result, indent=2) + "\n")
    print(f"wrote {arguments.out}")


if __name__ == "__main__":
    main()
