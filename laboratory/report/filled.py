"""Writes the measured parts of the pages on the laboratory from the results of its studies."""

import sys

import pandas as pd

from laboratory.report.answer import answer_text
from laboratory.report.wear import wear_text
from replication.report.filled import write_pages
from trackdyn.errors import InputError


def departures(rows: pd.DataFrame) -> str:
    """A line a departure, a column a scene: changes of RMS, high frequency and left share."""
    shown = ("rms_g", "high_frequency_g", "left_share_pct")

    def cell(group: pd.DataFrame) -> str:
        if isinstance(why := group["failed"].iloc[0], str) and why:
            return "refused" if why.startswith("scene: ") else "fails"
        found = group.set_index("measure")["difference"]
        return ", ".join(f"{found[name]:+.1f}".replace("-0.0", "0").replace("+0.0", "0") for name in shown)

    cells = rows.groupby(["departure", "scene"], sort=False)[["measure", "difference", "failed"]].apply(cell)
    return cells.unstack(sort=False).reset_index().to_markdown(index=False, disable_numparse=True)


def calibration(rows: pd.DataFrame) -> str:
    """Coverage of the 50 and 90 % intervals with their own 95 % intervals, and how even ranks are."""
    shown = rows[["discrepancy", "parameter", "truths", "identified"]].copy()
    for level in ("50", "90"):
        spans = zip(*(rows[f"{name}_{level}"] for name in ("covered", "low", "high")), strict=True)
        cells = [f"{100 * at:.1f} % ({100 * low:.0f} to {100 * high:.0f})" for at, low, high in spans]
        shown[f"in {level} % intervals"] = cells
    known = 100 * rows["covered_90_identified"]
    shown["of those identified"] = ["–" if pd.isna(one) else f"{one:.1f} %" for one in known]
    shown["p_uniform"] = ["–" if pd.isna(one) else f"{one:.2g}" for one in rows["p_uniform"]]
    shown["bins outside"] = ["–" if pd.isna(one) else f"{one:.0f}" for one in rows["bins_outside"]]
    return shown.to_markdown(index=False, disable_numparse=True)


def identified(rows: pd.DataFrame) -> str:
    """What an identification came to, in short."""
    cells = rows.map(lambda value: value if isinstance(value, str) else "–" if pd.isna(value) else f"{value:.3g}")
    return cells.to_markdown(index=False, disable_numparse=True)


ANSWER = ("ends", "verdicts", "robustness", "profiles")
PAGES = (
    ("docs/deviations.md", ("deviations.csv",), departures), ("docs/identify.md", ("calibration.csv",), calibration),
    ("docs/identify-synthetic.md", ("identify_synthetic.csv",), identified),
    ("docs/answer.md", tuple(f"answer_{name}.csv" for name in ANSWER), answer_text),
    ("docs/wear.md", ("wear_lives.csv",), wear_text),
)  # fmt: skip

if __name__ == "__main__":
    try:
        write_pages(sys.argv[1:], PAGES)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
