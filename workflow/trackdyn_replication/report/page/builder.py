"""Put the page together from what lies in the results folder; what is missing is named, not left blank."""

from trackdyn.sweeps.snakemake_job import run_job

import base64
import html
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pandas as pd
from PIL import Image

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import read_npz, write_text
from trackdyn.jit import source_hash
from trackdyn.measure.catalogue import NAMED
from trackdyn.measure.cells import significant
from trackdyn.measure.columns import words
from trackdyn.measure.ring_advice import advice
from trackdyn.measure.ring_rule import COMPARED, DurationRule, RingRule
from trackdyn.plots.rendering import render
from trackdyn.plots.style import DPI
from trackdyn.version import __version__
from trackdyn_replication.paper.contents import OF_STUDIES, OWN, PAPER, missing_items
from trackdyn_replication.paper.scorecard import (
    MARKS,
    answer_sentences,
    number_rows,
    outside_sentence,
    statements_by_label,
    waiting_sentence,
)
from trackdyn_replication.report.figures.trade import same_answer
from trackdyn_replication.study.settings import STUDIES

# kinds of parameters, uncertain ones first
KINDS = {
    "fitted": "chosen so that the model shows a printed result", "assumed": "not in the paper, taken to be plausible",
    "derived": "follows from printed numbers", "printed": "stands in the paper",
}  # fmt: skip
SCRIPTS = ("shared", "page")  # one module, in this order
COLOURS_OF_A_PICTURE = 16
FRONT = "fig24"  # on the first screen
# columns of published tables that the page leaves out, with all errors
LEFT_OUT: dict[str, tuple[str, ...]] = {
    "table3": ("sensor_record",), "table4": (), "lines": ("printed_of_papers",),
    "fidelity": ("sd", "ring_share", "loop_gap_m"),
}  # fmt: skip
# The order of the paper's text, where tables stand between figures; the parts that it has.
AFTER = {"table1": "fig07+", "table2": "fig14+", "table3": "fig17+", "table4": "fig18+"}
PARTS = {
    "The model": "fig14",
    "The loop compared with another code and with the sensor": "fig19",
    "The sprocket": "fig25",
}
WITH = {"fig18": "lines"}  # a table of ours below a figure of the paper
# the last one with its trial
PROMISED = ("measure", "tolerance_pct", "achieved_error_pct", "met", "setting", "duration_s", "cpu_s")
PLACED = {
    *WITH.values(),
    "grip",
    "creep",
    "trade",
    "fidelity",
}  # ours that the template places by name; others follow the paper's
OTHERS = [name for name in STUDIES if name not in ("trade", "fidelity")]  # studies with a section of their own
# tables whose files the page hands out; the first folder that has one
TABLES = (
    "claims.csv", "metrics.csv", "trade.csv", "planner.csv", *(f"{name}.csv" for name in OTHERS), "tables/fidelity.csv",
    "tables/parameters.csv", "tables/extremes.csv", "tables/extremes_short_runs.csv", "tables/lines.csv",
    *(f"tables/{item.key}.csv" for item in PAPER if item.table),
)  # fmt: skip


def build_page(
    results: Path,
    synthetic: bool | None = True,
    layers: Sequence[str] = (),
    studies: Sequence[str] = (),
    short: str = "",
    own: bool = False,
    plausible: Mapping[str, str] | None = None,
    teeth: int | None = None,
) -> str:
    """The page as HTML text, from the folder that the workflow wrote.

    ``synthetic`` says whether the sensor's records are (None: there are none), ``layers`` are configurations on top of
    the base, ``studies`` those of this run, ``short`` how it is shorter than the paper's. An ``own`` rig is not the one
    that was fitted to the paper; for that ``plausible`` are tables of plausible tracks, and their ``picture``. Without
    its ``teeth`` nothing is said of the choice of the ring.
    """
    recordings = check_sources(sorted((results / "runs").rglob("*.npz")))
    files = {name: path.read_text(encoding="utf-8") for name in TABLES if (path := results / name).is_file()}
    with ThreadPoolExecutor() as pool:  # most of the time is the packing of pictures, without the interpreter
        entries = list(pool.map(partial(_entry, results, synthetic), (*PAPER, *OWN, *OF_STUDIES)))
    by_key = {entry["item"].key: entry for entry in entries if entry["pictures"] or entry["rows"]}
    of_paper = sorted((item.key for item in PAPER), key=lambda key: AFTER.get(key, key))
    parts: dict[str, list] = {}
    for key in (key for key in of_paper if key in by_key):
        section = next(section for section, end in PARTS.items() if AFTER.get(key, key) < end)
        parts.setdefault(section, []).append(by_key[key])
    parameters, planner = _rows(results, "tables/parameters.csv"), _rows(results, "planner.csv") or []
    same = same_answer(pd.DataFrame([row for row in planner if row["measure"] == "rms" and row["met"] is not None]))
    for row in planner:
        if row["met"] is not None:
            row["cpu_s"] += row["trial_cpu_s"]
            row["setting"] = ", ".join(map(words, row["setting"].split(", ")))
        for name in ("tolerance", "achieved_error"):
            row[f"{name}_pct"] = None if row[name] is None else 100 * row[name]
        measure = NAMED[row["measure"]]
        row["measure"] = measure.words + (" (of a turn)" if measure.kind == "turns" else "")
    card, of_ring = _card(results, own, plausible), _ring_study(results, teeth)
    there = {  # sections of the page
        "sensor": "table3" in by_key, "numbers": card and card["numbers"], "figures": True,
        "sprocket": "The sprocket" in parts, "ring-study": of_ring,
        "tracks": (card and card["picture"]) or {"grip", "creep"} & {*by_key}, "front": True,
    } | dict.fromkeys((*OTHERS, "parameters", "provenance"), True)  # fmt: skip
    return render(
        "page.html.j2",
        SCRIPTS,
        {"files": files},
        Path(__file__).parent,
        card=card,
        sections=[name for name, shown in there.items() if shown],
        short=short,
        own=own,
        symbols=MARKS,
        synthetic=synthetic,
        parameters=parameters and {kind: [row for row in parameters if row["kind"] == kind] for kind in KINDS},
        kinds=KINDS,
        fidelity=by_key.get("fidelity"),
        same_answer=same,
        planner=[{name: row[name] for name in PROMISED if name in row} for row in planner],
        scenes="; ".join(dict.fromkeys(row["scene"] for row in planner)),
        recordings=recordings,
        version=__version__,
        sources=source_hash(),
        parts=parts,
        ours=[
            by_key[item.key]
            for item in (*OWN, *OF_STUDIES)
            if item.key in by_key and item.key not in PLACED and item.rule not in OTHERS
        ],
        beside=WITH,
        entries=by_key,
        of_ring=of_ring,
        others={name: [entry for entry in by_key.values() if entry["item"].rule == name] for name in OTHERS},
        front=by_key.get(FRONT),
        missing=missing_items(results),
        earlier=[name for name in STUDIES if name not in studies and (results / f"{name}.csv").is_file()],
        layers=" ".join(["", "--configfile", *layers]) if layers else "",
        paper_items=len(PAPER),
    )


def check_sources(recordings: Iterable[Path]) -> int:
    """Count recordings, all made by the present program. Raises `InputError`: one was made by another version."""
    expected, count = source_hash(), 0
    for path in recordings:
        meta, _ = read_npz(path, "trackdyn recording", float("inf"), arrays=False)
        if meta.get("sources") != expected:
            raise InputError(
                f"{path}: was made by another version of the program (sources {meta.get('sources')}, present "
                f"{expected}); run `snakemake -j2` again, or remove the file if no run of the configuration makes it"
            )
        count += 1
    return count


def _card(results: Path, own: bool, plausible: Mapping[str, str] | None) -> dict | None:
    """Statements of the paper by the figure or table that they are about, and the answer in sentences."""
    if not (results / "claims.csv").is_file():
        return None
    card, judged = pd.read_csv(results / "claims.csv", dtype={"part": str}), pd.read_csv(results / "sentences.csv")
    tables = {name: path for name, path in (plausible or {}).items() if name != "picture"}
    shares = {name: pd.read_csv(path, dtype={"name": str}) for name, path in tables.items()}
    numbers = pd.read_csv(results / "printed_numbers.csv", dtype={"part": str})
    rig, parameters = card["rig"].iloc[0], results / "tables" / "parameters.csv"
    known = (
        [outside_sentence(pd.read_csv(parameters), rig, shares.get("mobilised"))]
        if parameters.is_file() and not own
        else []
    )
    return {
        "rig": rig,
        "said": {} if own else statements_by_label(card, judged, shares),
        "shares": bool(shares),
        "answer": _caption_html(answer_sentences(card, judged, numbers, shares, own)),
        "numbers": [] if own else number_rows(numbers),
        "marks": [] if own else judged.to_dict("records"),
        "picture": embedded_picture(Path(plausible["picture"])) if plausible else None,
        "known": _caption_html(known),
        "waiting": "" if own else _caption_html([waiting_sentence(card)]),
    }


def _ring_study(results: Path, teeth: int | None) -> dict:
    """Return the advice on the ring study and the measures that it weighs: a row per radius, ranges over speeds."""
    path = results / "metrics.csv"
    metrics = pd.read_csv(path) if path.is_file() else pd.DataFrame(columns=["run"])
    study = metrics[metrics["run"].str.startswith("ring/")]
    if study.empty or not {*COMPARED} <= {*study} or not teeth:
        return {}
    rows = []
    for radius, group in study.groupby(study["ring_radius_m"].fillna(0.0)):
        spans = {
            column: " to ".join(dict.fromkeys(map(significant, (group[column].min(), group[column].max()))))
            for column in COMPARED
        }
        rows.append({"ring_radius_m": f"{radius:g}" if radius else "none"} | spans)
    return {"advice": advice(study, RingRule(), DurationRule(teeth)), "rows": rows}


def _rows(results: Path, name: str) -> list[dict] | None:
    """Rows of a CSV file with None for empty cells; None if the file does not exist."""
    if not (path := results / name).is_file():
        return None
    table = pd.read_csv(path)
    return table.astype(object).where(table.notna(), None).to_dict("records")


def _entry(results: Path, synthetic: bool | None, item) -> dict:
    files = item.files(results)
    rows = _rows(files[0].parent, files[0].name) if item.table and files else None
    if rows and item.key in LEFT_OUT:  # errors stand in the CSV file, beside their values
        dropped = {*LEFT_OUT[item.key], *(name for name in rows[0] if "error" in name)} - {"sensor_record"}
        rows = [{name: value for name, value in row.items() if name not in dropped} for row in rows]
    return {
        "item": item,
        "id": item.key if item.label else f"our-{item.key}",
        "caption": _caption_html(item.caption(synthetic)),
        "pictures": [] if item.table else [embedded_picture(file) for file in files],
        "rows": rows,
    }


def _caption_html(paragraphs: list[str]) -> str:
    """Paragraphs of plain text with names in backquotes as HTML."""
    text = "\n".join(f"<p>{html.escape(paragraph, quote=False)}</p>" for paragraph in paragraphs)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def embedded_picture(path: Path) -> dict:
    """A picture as a data address with its size in pixels, with the few colours that line drawings need."""
    rare = Image.Quantize.MAXCOVERAGE  # keeps the colour of a few marks; a median cut makes them grey
    with Image.open(path) as image:
        inches = image.width / image.info.get("dpi", (DPI,))[0]
        few = image.convert("RGB").quantize(COLOURS_OF_A_PICTURE, rare, dither=Image.Dither.NONE).convert("RGB")
    buffer = io.BytesIO()
    few.save(buffer, format="WEBP", lossless=True, quality=75)
    uri = "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
    letter = path.stem.rpartition("_")[2]
    label = f", part {letter}" if len(letter) == 1 else ""
    return {"uri": uri, "width": few.width, "height": few.height, "inches": round(inches, 2), "part": label}


@run_job
def main(job) -> None:
    """Rule `page`."""
    params = job.params
    names = ("synthetic", "layers", "studies", "short", "own", "plausible", "teeth")
    page = build_page(Path(params.results), **{name: params[name] for name in names})
    write_text(job.output[0], page)
