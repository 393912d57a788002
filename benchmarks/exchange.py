"""How long an exchange with a co-simulation unit takes: median and 99.9th percentile, through FMPy and natively.

    python benchmarks/exchange.py --out results/benchmarks/exchange.json

Times are of this machine, which may do other work; the first exchanges, in which kernels are loaded, are left out.
"""

import argparse
import json
import platform
import tempfile
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

WARM, EXCHANGE = 200, 1e-3  # exchanges left out; length of one, s
CASES = [
    (preset, changes, native)
    for preset in ("standard", "fast")
    for native in (True, False)
    for changes in (False, True)
]


def speeds(count: int, changes: bool) -> np.ndarray:
    """Motor speed of every exchange, rev/min."""
    return 115.0 + (5.0 * np.sin(np.arange(count) * 0.01) if changes else np.zeros(count))


def native_times(scene, wanted) -> np.ndarray:
    """Time of every exchange with the unit as Python has it, s."""
    from laboratory.fmi.unit import Unit

    unit, times = Unit(scene), np.zeros(len(wanted))
    unit.start()
    for k, speed in enumerate(wanted):
        begin = time.perf_counter()
        unit.wanted["motor_rpm"] = speed
        unit.step(k * EXCHANGE, EXCHANGE)
        times[k] = time.perf_counter() - begin
    return times


def imported_times(scene, wanted) -> np.ndarray:
    """Time of every exchange through FMPy, one input written and every output read, s."""
    import fmpy

    from laboratory.fmi.build import write_fmu

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "track.fmu")
        write_fmu(scene, file)
        description = fmpy.read_model_description(str(file))
        unit = fmpy.instantiate_fmu(fmpy.extract(str(file), folder), description, "CoSimulation")
        numbers = {variable.name: variable.valueReference for variable in description.modelVariables}
        outputs = [variable.valueReference for variable in description.modelVariables if variable.causality == "output"]
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        times = np.zeros(len(wanted))
        for k, speed in enumerate(wanted):
            begin = time.perf_counter()
            unit.setFloat64([numbers["motor_rpm"]], [speed])
            unit.doStep(currentCommunicationPoint=k * EXCHANGE, communicationStepSize=EXCHANGE)
            unit.getFloat64(outputs)
            times[k] = time.perf_counter() - begin
        unit.terminate()
        unit.freeInstance()
    return times


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/exchange.json"), help="file to write")
    parser.add_argument("--rig", type=Path, default=Path("config/rigs/paper.yaml"))
    parser.add_argument("--exchanges", type=int, default=5000)
    options = parser.parse_args()
    from trackdyn import Scene, load_rig
    from trackdyn.files import check_writable, write_text
    from trackdyn.scene.choices import preset as preset_fields

    check_writable(options.out)
    rig, rows = load_rig(options.rig), []
    for preset, changes, native in tqdm(CASES, unit="case"):
        # at rest at time 0: from the start-up ramp on
        scene = Scene(rig, 115.0, lead_in=0.0, **preset_fields(preset))
        wanted = speeds(WARM + options.exchanges, changes)
        times = (native_times if native else imported_times)(scene, wanted)[WARM:]
        median, high = np.percentile(times, [50, 99.9])
        rows.append(
            {
                "preset": preset,
                "through": "Python" if native else "FMPy",
                "speed": "new every exchange" if changes else "constant",
                "median_ms": round(1e3 * median, 3),
                "p999_ms": round(1e3 * high, 3),
                "late": int((times > EXCHANGE).sum()),
            }
        )
    result = {
        "exchange_s": EXCHANGE,
        "exchanges": options.exchanges,
        "processor": platform.processor() or platform.machine(),
        "rows": rows,
    }
    write_text(options.out, json.dumps(result, indent=2) + "\n")
    for row in rows:
        tqdm.write(", ".join(f"{name} {value}" for name, value in row.items()))


if __name__ == "__main__":
    main()
