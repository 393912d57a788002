"""Writes the measured parts of the README and of pages in docs/ from the results of a full run."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from trackdyn.errors import InputError
from trackdyn.files import replacing, write_text
from replication.paper.claims import JUDGED, REPRODUCED, SHORT, headline
from laboratory.report.assumptions import assumptions_text, best_assumption
from replication.report.tables import ladder_table
from laboratory.report.wear import wear_text
from replication.study.extremes.resolved import verdict

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
    shown["limit"] = [
        f"{value:.6g} ± {error:.1g}" for value, error in zip(rows["limit"], rows["limit_error"], strict=True)
    ]
    for name in presets:
        shown[name] = [cell(row, name) for _, row in rows.iterrows()]
    shown["standard within 2 %"] = rows["standard_within_bound"].fillna("–")
    return shown.to_markdown(index=False, disable_numparse=True)


def claims_text(card: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Headlines of the rigs, then the first rig's claims beside the map from assumptions to claims.

    Predictions come first, then claims that transfer a fit to other speeds, failures at the top of each; a line each
    counts the claims that follow from the fit and those that were fitted.

    Parameters
    ----------
    card : DataFrame
        Scorecard, columns `paper.claims.COLUMNS`.
    rows : DataFrame
        Map from assumptions to claims (``docs/measured/assumptions.csv``).
    """
    own = card[(card["rig"] == card["rig"].iloc[0]) & card["verdict"].isin(JUDGED)].astype(object).fillna("")
    lines = []
    for origin in ("predicted", "transfer"):
        failed, met = [], []
        for claim_id, parts in own[own["origin"] == origin].groupby("id", sort=False):
            lost = list(parts.loc[parts["verdict"] != REPRODUCED, "part"])
            verdict = f"○ {len(lost)} of {len(parts)} parts fail" if lost else "● reproduced"
            names = [f"{claim_id}{part}" for part in parts["part"]]
            line = [
                claim_id,
                SHORT.get(claim_id, parts["claim"].iloc[0]),
                origin,
                verdict,
                *best_assumption(rows, names),
            ]
            (failed if lost else met).append(line)
        lines += failed + met
    for origin in ("follows", "fitted"):
        met = own[own["origin"] == origin].groupby("counts_as")["verdict"].agg(lambda v: (v == REPRODUCED).all())
        if len(met):
            named = ", ".join(met.index[met]) or "none"
            lines.append(["", f"{met.sum()} of {len(met)}: {named}", origin, "● reproduced", "", ""])
    heads = ["id", "claim", "origin", "default rig", "assumption that reproduces it", "price"]
    table = pd.DataFrame(lines, columns=heads)
    headlines = [f"**{name}**: {headline(card, name)}" for name in dict.fromkeys(card["rig"])]
    return "\n\n".join([*headlines, table.to_markdown(index=False, disable_numparse=True)])


def departures(rows: pd.DataFrame) -> str:
    """A line a departure, a column a scene: changes of RMS, high frequency and left share."""
    shown = ("rms_g", "high_frequency_g", "left_share_pct")

    def cell(group: pd.DataFrame) -> str:
        if (why := group["failed"].fillna("").iloc[0]) != "":
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
    shown["of those identified"] = [
        "–" if pd.isna(one) else f"{100 * one:.1f} %" for one in rows["covered_90_identified"]
    ]
    shown["p_uniform"] = ["–" if pd.isna(one) else f"{one:.2g}" for one in rows["p_uniform"]]
    shown["bins outside"] = ["–" if pd.isna(one) else f"{one:.0f}" for one in rows["bins_outside"]]
    return shown.to_markdown(index=False, disable_numparse=True)


def identified(rows: pd.DataFrame) -> str:
    """What an identification came to, in short."""
    cells = rows.map(lambda value: value if isinstance(value, str) else "–" if pd.isna(value) else f"{value:.3g}")
    return cells.to_markdown(index=False, disable_numparse=True)


def findings(rows: pd.DataFrame) -> str:
    """What an ensemble found, a line each; then its tables and pictures, where there are any."""

    def line(row: pd.Series) -> str:
        if row["file"] == "":
            return f"- {row['finding']}"
        picture = row["file"].endswith(".png")
        return (
            f"\n![{row['finding']}](pictures/ensemble_{row['file']})"
            if picture
            else f"- [{row['finding']}](measured/ensemble_{row['file']})"
        )

    return "\n".join(line(row) for _, row in rows.astype(object).fillna("").iterrows()) + "\n"


def layouts_text(rows: pd.DataFrame) -> str:
    """Outcomes of random layouts, one line per chain, and of all."""
    counted = ["layouts", "completed", "refused", "defect"]
    table = rows.groupby(["chain", "teeth"], sort=False)[counted].sum().reset_index()
    whole = pd.DataFrame([{"chain": "all", "teeth": "", **rows[counted].sum()}])
    table = pd.concat([table.astype({"teeth": str}), whole], ignore_index=True)
    table["completed, %"] = (100 * table["completed"] / table["layouts"]).map("{:.1f}".format)
    return table.to_markdown(index=False, disable_numparse=True)


def short_runs_text(rows: pd.DataFrame) -> str:
    """Short runs by kind of scene (`study.extremes.resolved.by_kind`), and what they come to."""
    shown = rows.rename(columns=lambda name: name.replace("_pct", ", %").replace("_", " ")).astype({"beyond": object})
    for name in ("rms off, %", "peak off, %"):
        shown[name] = ["–" if pd.isna(value) else f"{value:.2g}" for value in shown[name]]
    shown["beyond"] = shown["beyond"].fillna("–")
    return f"{shown.to_markdown(index=False, disable_numparse=True)}\n\n{verdict(rows)}"


def promises_text(rows: pd.DataFrame) -> str:
    """Promises of the planner on the problems of the benchmark, a line a problem and tolerance."""
    lines = []
    for (problem, tolerance), group in rows.groupby(["problem", "tolerance"]):
        made = group[group["met"].notna()]
        worst = (made["achieved_error"] / made["tolerance"]).max()
        lines.append({
            "problem": problem, "tolerance": f"{100 * tolerance:g} %", "measures": len(group), "promised": len(made),
            "kept": int(made["met"].astype(bool).sum()), "largest error, of its tolerance": f"{100 * worst:.0f} %",
            "not promised": ", ".join(group.loc[group["met"].isna(), "measure"]) or "–",
        })  # fmt: skip
    return pd.DataFrame(lines).to_markdown(index=False, disable_numparse=True)


def fill(page: Path, sources: Sequence[Path], write: Callable[..., str]) -> None:
    """Replace the measured part of a page by what ``write`` makes of one or more tables.

    Raises
    ------
    InputError
        A file is missing, or the page lacks its marks.
    """
    for source in sources:
        if not source.exists():
            raise InputError(f"{source}: no measured data; make them with `snakemake -j2`")
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"{page}: the marks {BEGIN} and {END} must occur once each")
    before, rest = text.split(BEGIN)
    written = write(*[pd.read_csv(source, keep_default_na=True) for source in sources])
    write_text(page, f"{before}{BEGIN}\n\n{written}\n{END}{rest.split(END)[1]}")


PAGES = (
    ("docs/choosing-a-fidelity.md", ("docs/measured/fidelity.csv",), ladder_text),
    ("docs/what-an-answer-costs.md", ("docs/measured/limits.csv",), limits),
    ("docs/deviations.md", ("docs/measured/deviations.csv",), departures),
    ("docs/identify.md", ("docs/measured/calibration.csv",), calibration),
    ("docs/identify-synthetic.md", ("docs/measured/identify_synthetic.csv",), identified),
    ("docs/ensemble.md", ("docs/measured/ensemble_summary.csv",), findings),
    ("docs/assumptions.md", ("docs/measured/assumptions.csv",), assumptions_text),
    ("docs/benchmark.md", ("docs/measured/benchmark_planner.csv",), promises_text),
    ("docs/resolution.md", ("docs/measured/extremes_short_runs.csv",), short_runs_text),
    ("docs/wear.md", ("docs/measured/wear_lives.csv",), wear_text),
    ("docs/your-own-rig.md", ("docs/measured/layouts.csv",), layouts_text),
    ("README.md", ("docs/measured/claims.csv", "docs/measured/assumptions.csv"), claims_text),
)

if __name__ == "__main__":
    try:
        for file in map(Path, sys.argv[1:]):  # results that version control keeps: pictures, and tables
            name = f"ensemble_{file.name}" if file.parent.name == "ensemble" else file.name
            place = Path("docs", "pictures" if file.suffix in (".gif", ".png") else "measured", name)
            with replacing(place) as part:
                part.write_bytes(file.read_bytes())
        for page, sources, write in PAGES:
            fill(Path(page), [Path(source) for source in sources], write)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
