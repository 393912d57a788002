"""Writes the measured parts of the pages on the laboratory from the results of its studies."""

import sys

import pandas as pd

from laboratory.report.plausible import answer_text
from replication.report.filled import write_pages
from trackdyn.errors import InputError


def identify_text(calibration: pd.DataFrame, synthetic: pd.DataFrame) -> str:
    """Coverage of the 50 and 90 % intervals of the unknowns; then what records came to that no rig explains."""
    every = calibration["parameter"] == "all unknowns"
    of_unknowns = calibration[
        every | ~calibration["parameter"].str.startswith("discrepancy.") & (calibration["discrepancy"] != "none")
    ]
    shown = of_unknowns[["discrepancy", "parameter", "truths", "identified"]].copy()
    for level in ("50", "90"):
        spans = zip(*(of_unknowns[f"{name}_{level}"] for name in ("covered", "low", "high")), strict=True)
        cells = [f"{100 * at:.0f} ({100 * low:.0f} to {100 * high:.0f})" for at, low, high in spans]
        shown[f"in {level} % intervals, %"] = cells
    verdict_of = synthetic.set_index(["of", "name"])["verdict"]
    verdicts = "; ".join(f"`{name}` {verdict}" for name, verdict in verdict_of["unknown"].items())
    wider = [name for name, verdict in verdict_of["discrepancy"].items() if verdict == "wider"]
    apart = "; ".join(f"{name} {verdict}" for name, verdict in verdict_of["held out"].items())
    return (
        f"{shown.to_markdown(index=False, disable_numparse=True)}\n\nSynthetic records: {verdicts}. Discrepancies "
        f"above their prior: {', '.join(wider) or 'none'}. Each record predicted from the other: {apart}."
    )


PLAUSIBLE = ("sentences", "claims", "draws", "values")
PAGES = (
    ("docs/identify.md", ("calibration.csv", "identify_synthetic.csv"), identify_text),
    ("docs/answer.md", tuple(f"plausible_{name}.csv" for name in PLAUSIBLE), answer_text),
)  # fmt: skip

if __name__ == "__main__":
    try:
        write_pages(sys.argv[1:], PAGES)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
