"""Compare the time a user waits with that of an earlier commit: both run in turn, so that the machine's drift cancels.

    python benchmarks/latency.py COMMIT [--turns 5] [--only "first run"]

Each row is the CPU time (user and system, children included) of a whole process: the median over the turns here and
there, and the median, least and largest ratio of the pairs. "first run" begins with an empty cache of kernels in every
turn; all other rows are warm. "pipeline", "quick" (its quick run) and "tests" take minutes a turn: they are run once,
and only if --only names them.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

COMMAND = [sys.executable, "-m", "trackdyn"]
SIMULATE = [*COMMAND, "simulate", "{folder}/run.npz", "-q", "--rpm", "115"]
STEPS = """
import time
from trackdyn import Loop, Scene, load_rig
rig = load_rig("trackdyn/rigs/paper.yaml")
loop = Loop(Scene(rig, 115.0, **{fields}))
loop.advance(20.0)
"""
SPATIAL = "{'space': 'spatial', 'tension': 'locked', 'step': 5e-5}"
ROWS = {
    "help": [*COMMAND, "--help"],
    "rigs": [*COMMAND, "rigs"],
    "import": [sys.executable, "-c", "import trackdyn; trackdyn.simulate"],
    "check": [*COMMAND, "check", "paper", "--out", "{folder}/paper.png", "--overwrite"],
    "simulate 20 s": [*SIMULATE, "--duration", "20"],
    "show": [*COMMAND, "show", "{folder}/run.npz", "--out", "{folder}/run.html", "--overwrite"],
    "planar step": [sys.executable, "-c", STEPS.replace("{fields}", "{}")],
    "step without ring": [sys.executable, "-c", STEPS.replace("{fields}", "{'ring_radius': None, 'step': 5e-5}")],
    "spatial step": [sys.executable, "-c", STEPS.replace("{fields}", SPATIAL)],
    "first run": [*SIMULATE, "--duration", "0.1", "--lead-in", "0"],
}
SLOW = {
    "pipeline": [sys.executable, "workflow/run.py", "-j2", "--forceall"],
    "quick": [sys.executable, "workflow/run.py", "-j2", "--forceall", "--configfile", "config/quick.yaml"],
    "tests": [sys.executable, "-m", "pytest", "-n", "2", "--dist", "loadfile"],
}
COLUMNS = ("measure", "here_cpu_s", "there_cpu_s", "ratio", "ratio_min", "ratio_max", "turns")


def processor_seconds(command: list[str], checkout: Path, folder: Path, cache: Path) -> float:
    """Return user and system seconds of a process and its children; it must succeed."""
    sources = os.pathsep.join(map(str, (checkout, checkout / "workflow")))  # in front of those that are installed
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [word.replace("{folder}", str(folder)) for word in command],
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": sources, "TRACKDYN_CACHE": str(cache), "OPENBLAS_NUM_THREADS": "1"},
        check=True,
        capture_output=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compare(name: str, command: list[str], checkouts: tuple[Path, Path], folder: Path, turns: int) -> dict:
    """Measure a row: both checkouts in turn, after one run of each that is not counted."""
    folders = tuple(folder / f"{k}" for k in range(2))  # neither reads the other's recordings
    for folder in folders:
        folder.mkdir(exist_ok=True)
    taken: list[list[float]] = [[], []]
    for turn in range(-1 if command in ROWS.values() and name != "first run" else 0, turns):
        for k, checkout in enumerate(checkouts):
            with tempfile.TemporaryDirectory(dir=folder) as empty:
                cache = Path(empty) if name == "first run" else folders[k] / "cache"
                seconds = processor_seconds(command, checkout, folders[k], cache)
            if turn >= 0:
                taken[k].append(seconds)
    ratios = [here / there for here, there in zip(*taken, strict=True)]
    middles = [statistics.median(values) for values in (*taken, ratios)]
    return dict(zip(COLUMNS, (name, *middles, min(ratios), max(ratios), len(ratios)), strict=True))


def main() -> None:
    """Measure and write the table."""
    import pandas as pd

    from trackdyn.inputs.files import write_csv

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="commit to compare with")
    parser.add_argument("--out", type=Path, default=ROOT / "results/benchmarks/latency.csv")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--only", default=",".join(ROWS), help=f"some of {', '.join(ROWS | SLOW)}; commas between them")
    options = parser.parse_args()
    measured = options.only.split(",")
    if unknown := set(measured) - set(ROWS | SLOW):
        parser.error(f"--only: {', '.join(sorted(unknown))} is none of {', '.join(ROWS | SLOW)}")
    if "show" in measured and "simulate 20 s" not in measured:
        parser.error("show needs the run that 'simulate 20 s' leaves: --only 'simulate 20 s,show'")
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder, "there")
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(there)], check=True)
        subprocess.run(["git", "checkout", "--quiet", options.commit], cwd=there, check=True)
        rows = []
        for name in measured:
            turns = 1 if name in SLOW else min(options.turns, 2) if name == "first run" else options.turns
            rows.append(compare(name, (ROWS | SLOW)[name], (ROOT, there), Path(folder), turns))
            print(pd.DataFrame(rows[-1:]).round(3).to_string(index=False, header=len(rows) == 1), flush=True)
    write_csv(options.out, pd.DataFrame(rows))


if __name__ == "__main__":
    main()
