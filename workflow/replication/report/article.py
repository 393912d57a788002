"""The article: its values from results, and its PDF from them by a template of Typst."""

from trackdyn.sweeps.snakemake_job import run_job

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from replication.paper.scorecard import (
    RUBBER,
    SHARES_READ,
    TRACKS,
    creep_counts,
    creep_slope,
    distance_sentence,
    headline,
    judged_sentences,
    learned_sentences,
    mobilised,
    neighbours_sentence,
    number_rows,
    outside_values,
    radius_sentence,
    share_of_tracks,
    statements,
    track_rows,
    verdict_line,
)
from replication.report.figures.peer import table2_outcome
from replication.report.figures.trade import trade_sentence
from replication.study.extremes.stability_map import stable_steps
from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.extras import required
from trackdyn.inputs.files import replacing, write_text
from trackdyn.measure.cells import cell, significant

# sentences of which the text gives the share of plausible tracks
SHARES = {"free": "19", "near_ten": "21", "flat": "20"}
EXTREMES = ("rows", "completed", "refused", "defects")
COLUMNS = {  # columns of the article's tables, by the table of the results
    "table1": ("area", "type", "O_x_mm", "O_y_mm", "r_mm", "theta_deg"),
    "table2": ("code", "step_s", "error_pct", "cpu_s_per_s"),
    "table3": (
        "speed_rpm",
        *(f"{name}_{what}" for name in ("rms", "sd") for what in (
            "simulation_g", "difference_printed_against_papers_own_data_pct")),
    ),
    "table4": (
        "rpm",
        *(f"{name}_{what}" for name in ("rms_g", "sd_g", "left_rms_n") for what in (
            "ten_arcs", "three_surfaces", "difference_pct")),
    ),
}  # fmt: skip


def article_values(tables: Mapping[str, pd.DataFrame], missing: str, accuracy_pct: float) -> dict[str, Any]:
    """Everything in the article that a run decides, as text.

    ``tables`` are those of the rule `article`; ``missing`` says why the independent code did not run, and
    ``accuracy_pct`` is the error at which Table 2 compares the codes.
    """
    card, judged = tables["claims"], tables["sentences"]
    parameters, outcomes = tables["parameters"], tables["outcomes"].iloc[-1]
    steps, tracks = stable_steps(tables["extremes"]), track_rows(tables["plausible_sentences"])
    learned = {name: tables[f"plausible_{name}"] for name in ("sentences", "map", "draws", "mobilised")}
    sampled, judged_tracks = learned["draws"], learned["draws"]["state"] == "done"
    return {
        "rig": card["rig"].iloc[0],
        "verdict": verdict_line(judged, tables["numbers"]),
        "headline": headline(judged, tables["numbers"]),
        "learned": learned_sentences(learned),
        "tracks": {
            "sampled": str(len(sampled)),
            "judged": str(judged_tracks.sum()),
            "engaged": str(int((sampled.loc[judged_tracks, "engaged"] == 1).sum())),
        },
        "share": {
            words: {group: share_of_tracks(tracks, name, group) for group in TRACKS} for words, name in SHARES.items()
        },
        "shares_read": SHARES_READ,
        "creep": dict(zip(("low", "other"), creep_counts(learned["map"], SHARES["free"]), strict=True))
        | {"bound": f"{RUBBER[0]:g}", "there": mobilised(learned["mobilised"], RUBBER[0])}
        | {"default": mobilised(learned["mobilised"], creep_slope(parameters))},
        "distance": distance_sentence(sampled),
        "tooth": _tooth(tables["plausible_tooth"]),
        "near": neighbours_sentence(tables["plausible_near"], judged),
        "radius": radius_sentence(card),
        "outside": "; ".join(outside_values(parameters)) or "none",
        "numbers": [list(row.values()) for row in number_rows(tables["numbers"])],
        "sentences": judged_sentences(judged, tables["plausible_sentences"]),
        "statements": _texts(statements(card)),
        "kinds": {kind: str(n) for kind, n in parameters["kind"].value_counts().items()}
        | {"all": str(len(parameters))},
        "outcomes": {name: str(outcomes[name]) for name in EXTREMES},
        "unstable_from": cell(float((steps["unstable"] / steps["limit"]).min()), 2),
        "codes": table2_outcome(tables["table2"], missing, accuracy_pct),
        "trade": trade_sentence(tables["planner"]),
    } | {name: _texts(tables[name][list(columns)]) for name, columns in COLUMNS.items()}


def _texts(frame: pd.DataFrame) -> list[list[str]]:
    return [
        [
            _percent(value) if name.endswith("difference_pct") else cell(value)
            for name, value in zip(frame, row, strict=True)
        ]
        for row in frame.itertuples(index=False)
    ]


def _percent(value) -> str:
    """Percent have no more than two decimals."""
    small = isinstance(value, float) and abs(value) < 10
    return f"{value:.2f}".replace("-0.00", "0.00") if small else significant(value)


def _tooth(changes: pd.DataFrame) -> dict[str, str]:
    """How far three surfaces in place of ten arcs change the RMS, with a ring and without one."""
    words = {"tracks": str(changes["draw"].nunique())}
    for name, rows in (("ring", changes.dropna()), ("bare", changes[changes["ring_radius_m"].isna()])):
        if rows.empty:
            words[name] = "–"
            continue
        low, middle, high = rows["change_pct"].abs().quantile([0.05, 0.5, 0.95])
        words[name] = f"{middle:.1f} % ({low:.1f} to {high:.1f})"
    return words


def write_article(values: dict[str, Any], values_path: Path, template: Path, figures: Path, pdf_path: Path) -> None:
    """Write the values, and the PDF that the template makes of them and of figures in a folder of results.

    Raises `InputError`: the package ``typst`` is not installed; `TrackdynError`: the template asks for a value or a
    figure that there is not.
    """
    typst = required("typst")
    write_text(values_path, json.dumps(values, indent=1, ensure_ascii=False) + "\n")
    inputs = {"values": str(values_path.resolve()), "results": str(figures.resolve())}
    try:
        document = typst.compile(
            str(template.resolve()), root="/", sys_inputs=inputs, format="pdf", ignore_system_fonts=True
        )
    except typst.TypstError as error:
        raise TrackdynError(f"{template}: {error}") from None
    with replacing(pdf_path) as temporary:
        temporary.write_bytes(document)


@run_job
def main(job) -> None:
    """Rule `article`."""
    inputs = job.input
    tables = {name: pd.read_csv(path) for name, path in inputs.items() if str(path).endswith(".csv")}
    missing = json.loads(Path(inputs.model).read_text(encoding="utf-8"))["missing"]
    values, pdf = article_values(tables, missing, job.params.accuracy_pct), Path(job.output.pdf)
    write_article(values, Path(job.output.values), Path(inputs.template), pdf.parent, pdf)
