"""Error and CPU time of every code, method and step on one problem: a CSV and a diagram.

    python measure.py teeth out/teeth.csv out/teeth.png [--short]

The first run of a setting is scored and warms up, three more are timed; a run of another code that takes longer than
``LONG`` is timed itself, once, but for the first of a method. One thread.
"""

import csv
import os
import sys
from io import StringIO
from textwrap import fill

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

import numpy as np
import run_exudyn
import run_mujoco
import run_trackdyn
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from laboratory.benchmark.score import HEADLINE, score
from trackdyn.errors import TrackdynError
from trackdyn.files import write_text
from trackdyn.plots.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SMALL, VERMILION, new_figure, save, styled

REPETITIONS, LONG = 3, 5.0  # s
OWN, EXUDYN, MUJOCO = "trackdyn", "exudyn", "mujoco"
# steps (s), of the adaptive method tolerances; presets: linearly implicit 5e-4, semi-implicit 1e-4, 5e-5 and 1e-5 s
SETTINGS = {
    (OWN, "linearly_implicit"): (1e-3, 5e-4, 2e-4, 1e-4, 5e-5),
    (OWN, "semi_implicit"): (2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
    (OWN, "rk4"): (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5),
    (OWN, "adaptive"): (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
    (EXUDYN, "generalized_alpha"): (1e-3, 5e-4, 2e-4),
    (MUJOCO, "euler"): (1e-3, 5e-4, 2e-4),
    (MUJOCO, "implicitfast"): (1e-3, 5e-4),
}
SHORT = {(OWN, "semi_implicit"): (2e-4, 1e-4)}
COLUMNS = (
    "problem",
    "code",
    "method",
    "step",
    "cpu_s",
    "least_cpu_s",
    "most_cpu_s",
    "quantity",
    "error",
    "bar",
    "failure",
)
LOOKS = list(zip("os^DvXP", (BLUE, BLACK, VERMILION, ORANGE, PURPLE, GREEN, "0.5"), strict=True))
WORDS = {
    "place": "place of body 1",
    "acceleration": "acceleration of body 1",
    "left_peak_n": "mean peak, left arcs",
    "right_peak_n": "mean peak, right arcs",
}
REPORTS = 1e-3  # s: the step of the adaptive method is where it reports


def trackdyn(name: str, method: str, step: float, repetitions: int):
    """Answer of our own and its times."""
    asked = (REPORTS, step) if method == "adaptive" else (step, 0.0)
    series, contacts = run_trackdyn.answer(name, method, *asked)
    return series, contacts, [run_trackdyn.spend(name, method, *asked) for _ in range(repetitions)]


def peer(run):
    """The same of another code, whose runs give their own time; what its first one compiles is no part of it."""
    warm = set()

    def answers(name: str, method: str, step: float, repetitions: int):
        series, contacts, first = run(name, method, step)
        more = repetitions if first < LONG else int((name, method) not in warm)
        warm.add((name, method))
        return series, contacts, [run(name, method, step)[2] for _ in range(more)] or [first]

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
            print(
                code, method, step, f"{row['cpu_s']:.3g} s", [f"{o.quantity} {o.error:.1e}" for o in found], flush=True
            )
    return rows


@styled
def draw(rows: list[dict], name: str) -> Figure:
    """Work-precision diagram: a panel a quantity, a line a method, failures by name below."""
    quantities = [q for q in HEADLINE[name] if any(row.get("quantity") == q for row in rows)]
    figure = new_figure(4.0, 4.8 if len(quantities) == 1 else 7.2)
    panels = figure.subplots(1, len(quantities), squeeze=False, sharey=True)[0]
    for panel, quantity in zip(panels, quantities, strict=True):
        here = [row for row in rows if row.get("quantity") == quantity]
        for key, (marker, colour) in zip(SETTINGS, LOOKS, strict=True):
            own = [row for row in here if (row["code"], row["method"]) == key]
            if not own:
                continue
            error = [row["error"] for row in own]
            middle, least, most = np.array([[row[k] for k in COLUMNS[4:7]] for row in own]).T
            label = f"{key[0]}, {key[1].replace('_', ' ')}"
            if key[0] == MUJOCO and name != "free_chain":
                label += " (own contact)"
            look = {"marker": marker, "color": colour, "linestyle": "-", "capsize": 2}
            panel.errorbar(error, middle, yerr=[middle - least, most - middle], label=label, **look)
        bar = here[0]["bar"]
        panel.set(xscale="log", yscale="log", xlabel=f"relative error: {WORDS[quantity]}")
        panel.set_xlim(min(*(row["error"] for row in here), bar) / 2, max(row["error"] for row in here) * 2)
        panel.axvspan(panel.get_xlim()[0], bar, color="0.9", zorder=0, label="within the reference's error bar")
        panel.yaxis.set_minor_formatter(NullFormatter())
    panels[0].set_ylabel("CPU time (s), one thread")
    failed: dict[str, set] = {}
    for row in rows:
        if row.get("failure"):
            failed.setdefault(f"{row['code']}, {row['method'].replace('_', ' ')}", set()).add(row["step"])
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2 + (len(quantities) > 1))
    text = "; ".join(f"{key} at {', '.join(f'{s:g}' for s in sorted(steps))}" for key, steps in failed.items())
    figure.supxlabel(fill(f"failed: {text}" if text else "failed: none", 75 * len(quantities)), fontsize=SMALL)
    return figure


def main(name: str, table: str, picture: str, short: str = "") -> None:
    """Measure a problem and write both files."""
    rows = measure(name, SHORT if short else SETTINGS, 1 if short else REPETITIONS)
    lines = [COLUMNS, *([row.get(key, "") for key in COLUMNS] for row in rows)]
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [f"{v:.4g}" if isinstance(v, float) else v for v in line] for line in lines
    )
    write_text(table, text.getvalue())
    save(draw(rows, name), picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
