"""Writes the measured parts of the README and of docs/choosing-a-fidelity.md from the results of a full run."""

import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd

from trackdyn.errors import InputError
from trackdyn.paper.claims import JUDGED, REPRODUCED, headline
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


def results(card: pd.DataFrame) -> str:
    """What came out for the first rig: the headline, then every open test, those that failed first."""
    rig = card["rig"].iloc[0]
    own = card[(card["rig"] == rig) & (card["origin"] == "predicted") & card["verdict"].isin(JUDGED)]
    own = own.sort_values("verdict", key=lambda verdict: verdict == REPRODUCED, kind="stable")
    table = own[["id", "claim", "printed", "measured", "unit", "verdict"]].fillna("")
    said = [f"{name}: {headline(card, name)}" for name in dict.fromkeys(card["rig"])]
    return "\n\n".join([*said, table.to_markdown(index=False, disable_numparse=True)])


def fill(page: Path, source: Path, write: Callable[[pd.DataFrame], str]) -> None:
    """Replace the measured part of a page by what ``write`` makes of a table.

    Raises
    ------
    InputError
        A file is missing, or the page lacks its marks.
    """
    if not source.exists():
        raise InputError(f"{source}: no measured data; make them with `snakemake -j2`")
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"{page}: the marks {BEGIN} and {END} must stand once each")
    before, rest = text.split(BEGIN)
    written = write(pd.read_csv(source, keep_default_na=True))
    page.write_text(f"{before}{BEGIN}\n\n{written}\n{END}{rest.split(END)[1]}", encoding="utf-8")


PAGES = (
    ("docs/choosing-a-fidelity.md", "results/fidelity.csv", measured),
    ("README.md", "results/claims.csv", results),
)

if __name__ == "__main__":
    try:
        for page, source, write in PAGES:
            fill(Path(page), Path(source), write)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
