"""Writes the measured parts of the README and of pages in docs/ from the results of a full run."""

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import pandas as pd

from replication.paper.scorecard import claim_counts, open_claims
from replication.report.fidelity import ladder_table
from replication.report.figures.trade import trade_sentence
from replication.study.extremes.resolved import short_runs_verdict
from trackdyn.errors import InputError
from trackdyn.files import replacing, write_text

IN_WORDS = 3  # open claims of each outcome that the README names
BEGIN, END = "<!-- measured -->", "<!-- end -->"


def ladder_text(rows: pd.DataFrame) -> str:
    """Markdown tables, one a scene, of the ladder's long table."""
    wide = ladder_table(rows)
    parts = []
    for scene, group in wide.groupby("scene", sort=False):
        standard = group.loc[group["setting"] == "preset=standard", "wall_s_per_s"].iloc[0]
        table = group.drop(columns=["scene", "wall_s_per_s", "loop_gap_m"])
        table = table.map(lambda v: v if isinstance(v, str) else (f"{v:+.2f}" if pd.notna(v) else "–"))
        table["closure error (m)"] = [f"{v:.1e}" if pd.notna(v) else "–" for v in group["loop_gap_m"]]
        ratio = group["wall_s_per_s"] / standard
        table["cost"] = [f"{v:.2g}" if pd.notna(v) else "–" for v in ratio]
        parts.append(f"**{scene}**\n\n{table.to_markdown(index=False, disable_numparse=True)}\n")
    return "\n".join(parts)


def limits(rows: pd.DataFrame) -> str:
    """Presets beside the limits of `presets_beside_limits`, each difference with its standard error."""
    presets = [name.removesuffix("_pct") for name in rows if name.endswith("_pct") and not name.endswith("_error_pct")]

    def cell(row: pd.Series, name: str) -> str:
        off, error = row[f"{name}_pct"], row[f"{name}_error_pct"]
        return "–" if pd.isna(off) else f"{off:+.3f} ± {error:.3f}"

    shown = rows[["scene", "measure"]].copy()
    pairs = zip(rows["limit"], rows["limit_error"], strict=True)
    shown["limit"] = [f"{value:.6g} ± {error:.1g}" for value, error in pairs]
    for name in presets:
        shown[name] = [cell(row, name) for _, row in rows.iterrows()]
    shown["standard within 2 %"] = rows["standard_within_bound"].fillna("–")
    return shown.to_markdown(index=False, disable_numparse=True)


def claims_text(card: pd.DataFrame) -> str:
    """What every rig reproduces, counted in a column each; then in words some that the first one leaves open."""
    rig = card["rig"].iloc[0]
    heads = f"Open claims that *{rig}* shows, for example", "It does not show, for example"
    sentences = [
        f"{head}: {'; '.join(claims[:IN_WORDS])}."
        for head, claims in zip(heads, open_claims(card, rig), strict=True)
        if claims
    ]
    return "\n\n".join([claim_counts(card).to_markdown(index=False, disable_numparse=True), *sentences])


def readme_text(card: pd.DataFrame, parameters: pd.DataFrame, rows: pd.DataFrame) -> str:
    """What came out, how much of the rig is known, and what an answer costs."""
    free = parameters["kind"].isin(("fitted", "assumed")).sum()
    known = (
        f"**Of {len(parameters)} parameters of the default rig {free} are fitted or assumed.** The paper prints few."
    )
    return f"{claims_text(card)}\n\n{known}\n\n**What an answer costs**: {trade_sentence(rows)}"


def layouts_text(rows: pd.DataFrame) -> str:
    """Outcomes of random layouts, one line per chain, and of all."""
    counted = ["layouts", "completed", "refused", "defect"]
    table = rows.groupby(["chain", "teeth"], sort=False)[counted].sum().reset_index()
    complete = pd.DataFrame([{"chain": "all", "teeth": "", **rows[counted].sum()}])
    table = pd.concat([table.astype({"teeth": str}), complete], ignore_index=True)
    table["completed, %"] = (100 * table["completed"] / table["layouts"]).map("{:.1f}".format)
    return table.to_markdown(index=False, disable_numparse=True)


def short_runs_text(rows: pd.DataFrame) -> str:
    """Short runs by kind of scene (`study.extremes.resolved.by_kind`), and what they come to."""
    shown = rows.rename(columns=lambda name: name.replace("_pct", ", %").replace("_", " ")).astype({"beyond": object})
    for name in ("rms off, %", "peak off, %"):
        shown[name] = ["–" if pd.isna(value) else f"{value:.2g}" for value in shown[name]]
    shown["beyond"] = shown["beyond"].fillna("–")
    return f"{shown.to_markdown(index=False, disable_numparse=True)}\n\n{short_runs_verdict(rows)}"


def fill(page: Path, sources: Sequence[Path], write: Callable[..., str]) -> None:
    """Replace the measured part of a page by what ``write`` makes of one or more tables."""
    for source in sources:
        if not source.exists():
            raise InputError(f"{source}: no measured data; make them with `snakemake -j2`")
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"{page}: the marks {BEGIN} and {END} must occur once each")
    before, rest = text.split(BEGIN)
    written = write(*[pd.read_csv(source, keep_default_na=True) for source in sources])
    write_text(page, f"{before}{BEGIN}\n\n{written}\n{END}{rest.split(END)[1]}")


def write_pages(files: Iterable[str], pages: Iterable[tuple[str, tuple[str, ...], Callable[..., str]]]) -> None:
    """Keep results in ``docs``, pictures and tables, and write the measured parts of pages anew."""
    for file in map(Path, files):
        with replacing(Path("docs", "pictures" if file.suffix in (".gif", ".png") else "measured", file.name)) as part:
            part.write_bytes(file.read_bytes())
    for page, sources, write in pages:
        fill(Path(page), [Path("docs", "measured", source) for source in sources], write)


PAGES = (
    ("docs/choosing-a-fidelity.md", ("fidelity.csv",), ladder_text),
    ("docs/what-an-answer-costs.md", ("limits.csv",), limits),
    ("docs/resolution.md", ("extremes_short_runs.csv",), short_runs_text),
    ("docs/your-own-rig.md", ("layouts.csv",), layouts_text),
    ("README.md", ("claims.csv", "parameters.csv", "trade.csv"), readme_text),
)

if __name__ == "__main__":
    try:
        write_pages(sys.argv[1:], PAGES)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
