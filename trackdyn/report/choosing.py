"""Writes the measured table of docs/choosing-a-fidelity.md from the results of the ladder."""

import sys
from pathlib import Path

import pandas as pd

from trackdyn.errors import InputError
from trackdyn.report.tables import ladder_table

BEGIN, END = "<!-- measured -->", "<!-- end -->"


def measured(rows: pd.DataFrame) -> str:
    """Markdown tables, one a scene, of the ladder's long table."""
    wide = ladder_table(rows)
    parts = []
    for scene, group in wide.groupby("scene", sort=False):
        standard = group.loc[group["setting"] == "preset=standard", "wall_s_per_s"].iloc[0]
        table = group.drop(columns=["scene", "wall_s_per_s", "loop_gap_m"])
        table = table.map(lambda v: v if isinstance(v, str) else (f"{v:+.2f}" if pd.notna(v) else "–"))
        table["loop gap (m)"] = [f"{v:.1e}" if pd.notna(v) else "–" for v in group["loop_gap_m"]]
        ratio = group["wall_s_per_s"] / standard
        table["cost"] = [f"{v:.2g}" if pd.notna(v) else "–" for v in ratio]
        parts.append(f"**{scene}**\n\n{table.to_markdown(index=False, disable_numparse=True)}\n")
    return "\n".join(parts)


def fill(page: Path, ladder: Path) -> None:
    """Replace the measured part of the page.

    Raises
    ------
    InputError
        A file is missing, or the page lacks its marks.
    """
    if not ladder.exists():
        raise InputError(f"{ladder}: no measured data; make them with `snakemake -j1 fidelity`")
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"{page}: the marks {BEGIN} and {END} must stand once each")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n\n{measured(pd.read_csv(ladder))}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    try:
        fill(Path("docs/choosing-a-fidelity.md"), Path("results/fidelity.csv"))
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
