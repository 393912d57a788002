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
from trackdyn.measure.columns import significant
from trackdyn.measure.ring_rule import COMPARED, DurationRule, RingRule, advice
from trackdyn.plots.rendering import render
from trackdyn.plots.style import DPI
from trackdyn.version import __version__
from trackdyn_replication.paper import scorecard
from trackdyn_replication.paper.contents import OF_STUDIES, OWN, PAGE, PAPER, Item, missing_items
from trackdyn_replication.paper.tracks import learned_sentences
from trackdyn_replication.report.figures.trade import promises_sentence
from trackdyn_replication.report.summary import summary
from trackdyn_replication.study.settings import STUDIES

# kinds of parameters, uncertain ones first
KINDS = {
    "fitted": "chosen so that the model shows a printed result", "assumed": "not in the paper, taken to be plausible",
    "derived": "follows from printed numbers", "printed": "stands in the paper",
}  # fmt: skip
SCRIPTS = ("shared", "page")  # one module, in this order
COLOURS_OF_A_PICTURE = 16
# tables whose files the page hands out
TABLES = (
    *(f"{name}.csv" for name in ("claims", "metrics", "planner", "printed_numbers", "tables/parameters", *STUDIES)),
    *(f"tables/{item.key}.csv" for item in (*PAPER, *OWN, *OF_STUDIES) if item.table),
)  # fmt: skip


def build_page(
    results: Path, synthetic: bool | None = True, layers: Sequence[str] = (), studies: Sequence[str] = (),
    short: str = "", tracks: Mapping[str, str] | None = None, teeth: int | None = None,
) -> str:  # fmt: skip
    """Return the page as HTML, for a rig without sampled ``tracks`` and their ``picture`` that of its runs only."""
    check_sources(recordings := sorted((results / "runs").rglob("*.npz")))
    files = {name: path.read_text(encoding="utf-8") for name in TABLES if (path := results / name).is_file()}
    with ThreadPoolExecutor() as pool:  # most of the time is the packing of pictures, without the interpreter
        entries = list(pool.map(partial(_entry, results, synthetic, tracks is None), (*PAPER, *OWN, *OF_STUDIES)))
    shown = {entry["item"].key: entry for entry in entries if entry["pictures"] or entry["rows"]}
    below = {figure: shown.pop(table) for figure, table in PAGE["below"].items() if {figure, table} <= {*shown}}
    parts, sections = PAGE["figures"], PAGE["sections"]
    placed = {key for section in (*parts.values(), *sections.values()) for key in section.get("items", ())}
    further = {"further": parts["further"] | {"items": [key for key in shown if key not in placed]}}
    parameters, promises = _rows(results, "tables/parameters.csv"), results / "planner.csv"
    return render(
        "own.html.j2" if tracks is None else "page.html.j2",
        SCRIPTS,
        {"files": files},
        Path(__file__).parent,
        card=_card(results, tracks), short=short, symbols=scorecard.MARKS, synthetic=synthetic, kinds=KINDS,
        parameters=parameters and {kind: [row for row in parameters if row["kind"] == kind] for kind in KINDS},
        planner=_html([promises_sentence(pd.read_csv(promises))]) if promises.is_file() else "",
        recordings=len(recordings), version=__version__, sources=source_hash(), below=below,
        parts=_sections(parts | further, shown), sections=_sections(sections, shown),
        first=next((shown[key] for key in PAGE["first"] if key in shown), None),
        sensor=shown["table3"]["rows"] if "table3" in shown and synthetic is False else None,
        of_ring=_ring_study(results, teeth), missing=missing_items(results), paper_items=len(PAPER),
        earlier=[name for name in STUDIES if name not in studies and (results / f"{name}.csv").is_file()],
        layers=" ".join(["", "--configfile", *layers]) if layers else "",
    )  # fmt: skip


def _sections(sections: Mapping[str, Mapping], shown: Mapping[str, dict]) -> list[dict]:
    """Return sections of `PAGE`, each with its ``entries`` and the ``missing`` items that a study would make."""
    of_studies = {item.key: item for item in (*OWN, *OF_STUDIES) if item.rule in STUDIES}
    return [
        {
            "id": name,
            "title": section["title"],
            "entries": [shown[key] for key in section.get("items", ()) if key in shown],
            "missing": [of_studies[key] for key in section["items"] if key in {*of_studies} - {*shown}],
        }
        for name, section in sections.items()
    ]


def check_sources(recordings: Iterable[Path]) -> None:
    """Refuse a recording that another version of the program made."""
    expected = source_hash()
    for path in recordings:
        meta, _ = read_npz(path, "trackdyn recording", float("inf"), arrays=False)
        if meta.get("sources") != expected:
            raise InputError(
                f"{path}: was made by another version of the program (sources {meta.get('sources')}, present "
                f"{expected}); run `snakemake -j2` again, or remove the file if no run of the configuration makes it"
            )


def _card(results: Path, tracks: Mapping[str, str] | None) -> dict | None:
    """Return the answer, and the paper's statements by figure or table; without ``tracks`` the rig's name."""
    if not (results / "claims.csv").is_file():
        return None
    card = pd.read_csv(results / "claims.csv", dtype={"part": str})
    about = {"rig": card["rig"].iloc[0], "said": {}, "numbers": [], "known": ""}
    if tracks is None:
        return about
    judged, numbers = (pd.read_csv(results / f"{name}.csv") for name in ("sentences", "printed_numbers"))
    parameters = pd.read_csv(results / "tables" / "parameters.csv")
    tables = {name: pd.read_csv(path, dtype={"name": str}) for name, path in tracks.items() if name != "picture"}
    links = {"finding": "#our-grip", "answer": "#tracks"}
    texts = summary(tables["study"], judged, numbers, parameters, tables["near"], tables, **links)
    return about | {
        "said": scorecard.statements_by_label(card, judged, tables),
        "summary": [_html([text]) for text in texts],
        "conclusions": scorecard.conclusion_table(judged, tables["grips"], tables["sentences"]),
        "failed": scorecard.failed_rows(card, judged),
        "speeds": max(card["speeds"].dropna(), key=len, default=""),
        "numbers": scorecard.number_rows(numbers),
        "marks": judged.to_dict("records"),
        "learned": _html(learned_sentences(tables)),
        "picture": embedded_picture(Path(tracks["picture"])),
        "known": _html([scorecard.outside_sentence(parameters, about["rig"], tables["mobilised"])]),
        "waiting": _html([scorecard.waiting_sentence(card)]),
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


def _entry(results: Path, synthetic: bool | None, own: bool, item: Item) -> dict:
    """Return an item with its place in the paper (none of an ``own`` rig), its caption, and its pictures or rows."""
    files = item.files(results)
    rows = _rows(files[0].parent, files[0].name) if item.table and files else None
    for left_out in (item.left_out, item.left_out_if_synthetic if synthetic else ""):
        if rows and left_out:
            rows = [
                {name: value for name, value in row.items() if not re.fullmatch(left_out, name)}
                for row in rows
                if not any(re.fullmatch(left_out, str(value)) for value in row.values())
            ]
    return {
        "item": item,
        "id": item.key if item.label else f"our-{item.key}",
        "label": "" if own else item.label,
        "caption": _html(item.caption(synthetic)),
        "pictures": [] if item.table else [embedded_picture(file) for file in files],
        "rows": rows,
    }


def _html(paragraphs: list[str]) -> str:
    """Return paragraphs of Markdown as HTML: names in backquotes, strong words, links."""
    text = "\n".join(f"<p>{html.escape(paragraph, quote=False)}</p>" for paragraph in paragraphs)
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    text = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", text)
    return re.sub(r"\[([^]]+)\]\(([^)]+)\)", r'<a href="\2">\1</a>', text)


def embedded_picture(path: Path) -> dict:
    """Return a picture as a data address with its size in pixels, with the few colours that line drawings need."""
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
    names = ("synthetic", "layers", "studies", "short", "tracks", "teeth")
    page = build_page(Path(params.results), **{name: params[name] for name in names})
    write_text(job.output[0], page)
