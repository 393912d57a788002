"""What has been tried for an order above one through impacts: mean peaks of `teeth` at equal error, and their cost.

    python impacts.py out.csv

Beside the methods as they are: a shorter step in the samples in which a tooth contact begins (the sample is taken
again), and mean peaks extrapolated to a step of zero from two runs.
"""

import sys
from time import process_time

import numpy as np
from run_trackdyn import answer as whole
from run_trackdyn import contacts_of_record, fresh, spend

from laboratory.benchmark.problems import read_problem, read_reference
from laboratory.benchmark.score import engagements
from trackdyn.files import write_text
from trackdyn.simulation.stepping import march

PEAKS = ("left_peak_n", "right_peak_n")


def flat(*parts):
    """Arrays of named tuples of arrays."""
    for part in parts:
        if isinstance(part, np.ndarray):
            yield part
        elif isinstance(part, tuple):
            yield from flat(*part)


def refined(step: float, parts: int) -> tuple[np.ndarray, float, float]:
    """Contacts of a semi-implicit run whose samples with a new tooth contact are taken with ``step / parts``.

    Returns the contacts, the CPU time (s) and the share of samples that were taken again.
    """
    _, model, state, work, record = fresh("teeth", "semi_implicit", step)
    fine = model._replace(step=model.step / parts, stride=model.stride * parts)
    record = record._replace(frame_stride=0)
    kept = [*flat(state, work), record.spells.open, record.spells.count]
    again, begin = 0, process_time()
    for sample in range(len(record.gap)):
        before = [array.copy() for array in kept]
        touching = state.tooth_impact > 0.0
        march(model, state, work, record, sample, sample + 1)
        if ((state.tooth_impact > 0.0) & ~touching).any() or record.spells.count[0] > before[-1][0]:
            for array, old in zip(kept, before, strict=True):
                array[...] = old
            change(state, work, parts)
            march(fine, state, work, record, sample, sample + 1)
            change(state, work, 1 / parts)
            again += 1
    return contacts_of_record(record), process_time() - begin, again / len(record.gap)


def change(state, work, parts: float) -> None:
    """Make what a step left behind that of a step shorter by ``parts``: count of steps, changes of velocities."""
    state.steps[0] = round(state.steps[0] * parts)
    for array in (work.com_dvx, work.com_dvy, work.turned):
        array /= parts


def peaks(contacts: np.ndarray) -> np.ndarray:
    """Mean peaks of both sides, N."""
    found = engagements(contacts, *read_problem("teeth")["report"]["window_s"])
    return np.array([found[name] for name in PEAKS])


def main(path: str) -> None:
    """Measure and write a row each way and step."""
    statistics = read_reference("teeth")[0]["statistics"]
    right = np.array([statistics[name]["value"] for name in PEAKS])
    rows, plain = ["way,step_s,left_error_pct,right_error_pct,cpu_s,note"], {}

    def add(way, step, found, cpu, note=""):
        off = 100 * (found / right - 1)
        rows.append(f"{way},{step:g},{off[0]:.4f},{off[1]:.4f},{cpu:.3f},{note}")
        print(rows[-1], flush=True)

    for method, steps in {
        "semi_implicit": (2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5), "rk4": (2e-4, 1e-4, 5e-5, 2.5e-5),
    }.items():  # fmt: skip
        for step in steps:
            found = plain[method, step] = peaks(whole("teeth", method, step)[1])
            plain[method, step, "cpu"] = min(spend("teeth", method, step) for _ in range(3))
            add(method, step, found, plain[method, step, "cpu"])
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
        found = peaks(whole("teeth", "adaptive", 1e-3, tolerance)[1])
        add(
            "adaptive",
            tolerance,
            found,
            min(spend("teeth", "adaptive", 1e-3, tolerance) for _ in range(3)),
            "step is a tolerance",
        )
    for method, steps in (("semi_implicit", (1e-4, 5e-5, 2.5e-5, 1.25e-5)), ("rk4", (1e-4, 5e-5))):
        for step in steps:
            found = 2 * plain[method, step] - plain[method, 2 * step]
            add(f"{method} extrapolated", step, found, plain[method, step, "cpu"] + plain[method, 2 * step, "cpu"])
    for step, parts in ((2e-4, 4), (1e-4, 2), (1e-4, 4), (1e-4, 8), (5e-5, 4)):
        runs = [refined(step, parts) for _ in range(3)]
        add(
            f"semi_implicit refined by {parts}",
            step,
            peaks(runs[0][0]),
            min(run[1] for run in runs),
            f"{runs[0][2]:.3f} of samples",
        )
    write_text(path, "\n".join(rows) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
