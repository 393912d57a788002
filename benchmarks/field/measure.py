"""Error and processor time of every code, method and step on one problem: a CSV and a diagram.

    python measure.py teeth out/teeth.csv out/teeth.png [--short]

The first run of a setting is scored, three more are timed (the first is warm-up: kernels are compiled); a code whose run
takes long is scored in the runs that are timed. One thread.
"""

import csv
import os
import sys

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

import numpy as np

import run_exudyn
import run_mujoco
import run_trackdyn
from trackdyn.benchmark.score import HEADLINE, score
from trackdyn.errors import TrackdynError
from trackdyn.files import write_text

REPETITIONS = 3
OWN, EXUDYN, MUJOCO = "trackdyn", "exudyn", "mujoco"
# steps (s), of the adaptive method tolerances; presets: linearly implicit 5e-4, semi-implicit 1e-4, 5e-5 and 1e-5 s
SETTINGS = {
    (OWN, "linearly_implicit"): (1e-3, 5e-4, 2e-4, 1e-4, 5e-5),
    (OWN, "semi_implicit"): (2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
    (OWN, "rk4"): (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5),
    (OWN, "adaptive"): (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
    (EXUDYN, "generalized_alpha"): (1e-3, 5e-4, 2e-4),
    (MUJOCO, "euler"): (1e-3, 5e-4, 2e-4),
    (MUJOCO, "implicitfast"): (1e-3, 5e-4, 2e-4),
}
SHORT = {(OWN, "semi_implicit"): (2e-4, 1e-4), (OWN, "rk4"): (2e-4, 1e-4)}
COLUMNS = ("problem", "code", "method", "step", "cpu_s", "least_cpu_s", "most_cpu_s", "quantity", "error", "bar", "failure")
REPORTS = 1e-3  # s: the step of the adaptive method is where it reports


def trackdyn(name: str, method: str, step: float, repetitions: int):
    """Answer of our own and its times."""
    asked = (REPORTS, step) if method == "adaptive" else (step, 0.0)
    series, contacts = run_trackdyn.answer(name, method, *asked)
    return series, contacts, [run_trackdyn.spend(name, method, *asked) for _ in range(repetitions)]


def peer(run):
    """The same of another code, whose runs give their own time."""

    def answers(name: str, method: str, step: float, repetitions: int):
        runs = [run(name, method, step) for _ in range(repetitions)]
        return *runs[0][:2], [one[2] for one in runs]

    return answers


CODES = {OWN: trackdyn, EXUDYN: peer(run_exudyn.answer), MUJOCO: peer(run_mujoco.answer)}


def measure(name: str, settings: dict, repetitions: int = REPETITIONS) -> list[dict]:
    """Rows (``COLUMNS``), one a setting and quantity; a setting that fails has one row that says so."""
    rows = []
    for (code, method), steps in settings.items():
        for step in steps:
            row = {"problem": name, "code": code, "method": method, "step": step}
            try:
                series, contacts, times = CODES[code](name, method, step, repetitions)
                toothed = contacts if name == "teeth" else None
                found = score({k: np.asarray(v) for k, v in series.items()}, toothed, name)
            except TrackdynError as error:
                rows.append(row | {"failure": str(error)})
                print(code, method, step, error, flush=True)
                continue
            row |= {"cpu_s": np.median(times), "least_cpu_s": min(times), "most_cpu_s": max(times)}
            rows += [
                row | {"quantity": one.quantity, "error": one.error, "bar": one.bar}
                if np.isfinite(one.error)
                else row | {"failure": f"{one.quantity} is not finite"}
                for one in found
            ]
            print(code, method, step, f"{row['cpu_s']:.3g} s", [f"{o.quantity} {o.error:.1e}" for o in found], flush=True)
    return rows


def draw(rows: list[dict], name: str, path: str) -> None:
    """Work-precision diagram: a panel a quantity, a line a method, failures by name below."""
    import matplotlib.pyplot as plt

    from trackdyn.report.style import save

    quantities = [q for q in HEADLINE[name] if any(row.get("quantity") == q for row in rows)]
    figure, panels = plt.subplots(1, len(quantities), figsize=(5.6 + 3.4 * (len(quantities) - 1), 4.8), squeeze=False)
    looks = dict(zip(SETTINGS, zip("os^vDPX", ["C0", "C1", "C2", "C3", "C4", "C5", "C6"]), strict=True))
    for panel, quantity in zip(panels[0], quantities, strict=True):
        for key, (marker, colour) in looks.items():
            own = [r for r in rows if (r["code"], r["method"]) == key and r.get("quantity") == quantity]
            if not own:
                continue
            x, y = np.array([r["error"] for r in own]), np.array([[r[k] for k in COLUMNS[4:7]] for r in own]).T
            label = f"{key[0]}, {key[1].replace('_', ' ')}" + (", contact of its own" if key[0] == MUJOCO and name != "free_chain" else "")
            panel.errorbar(x, y[0], yerr=[y[0] - y[1], y[2] - y[0]], marker=marker, color=colour, label=label, capsize=2, ms=5)
        bar = next(r["bar"] for r in rows if r.get("quantity") == quantity)
        low, high = panel.get_xlim()
        panel.axvspan(bar / 1e3, bar, color="0.9", zorder=0, label="error bar of the reference")
        panel.set(xscale="log", yscale="log", xlabel=f"relative error, {quantity.replace('_', ' ')}")
        values = [r["error"] for r in rows if r.get("quantity") == quantity]
        panel.set_xlim(min([*values, bar]) / 2, max(values) * 2)
        panel.grid(True, which="major", alpha=0.3)
    panels[0, 0].set_ylabel("processor time (s), one thread")
    failed = {}
    for row in rows:
        if row.get("failure"):
            failed.setdefault(f"{row['code']}, {row['method'].replace('_', ' ')}", set()).add(row["step"])
    text = "; ".join(f"{key} at {', '.join(f'{s:g}' for s in sorted(steps))}" for key, steps in failed.items())
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2 + (len(quantities) > 1), frameon=False, fontsize=8)
    if text:
        figure.supxlabel(f"failed: {text}", fontsize=8, wrap=True)
    figure.set_layout_engine("constrained")
    save(figure, path)


def main(name: str, table: str, picture: str, short: str = "") -> None:
    """Measure a problem and write both files."""
    rows = measure(name, SHORT if short else SETTINGS, 1 if short else REPETITIONS)
    lines = [COLUMNS, *([row.get(key, "") for key in COLUMNS] for row in rows)]
    from io import StringIO

    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [f"{v:.4g}" if isinstance(v, float) else v for v in line] for line in lines
    )
    write_text(table, text.getvalue())
    draw(rows, name, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
