"""Put the page together from what lies in the results folder; what is missing is named, not left blank."""

from trackdyn.sweeps.snakemake_job import run_job

import base64
import html
import io
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pandas as pd
from PIL import Image

from replication.certify.provenance import check_sources
from replication.paper.claims import JUDGED, VERDICTS
from replication.paper.contents import OF_STUDIES, PAPER, missing_items
from replication.paper.scorecard import MARKS, answer_sentences, headline, judged_sentences, statements
from replication.report.figures.trade import trade_sentence
from replication.studies import STUDIES
from trackdyn.files import write_text
from trackdyn.measure.columns import MEASURES
from trackdyn.plots.rendering import render
from trackdyn.sources import source_hash
from trackdyn.version import __version__

# what is uncertain comes first
KINDS = {
    "fitted": "chosen so that the model shows a printed result", "assumed": "not in the paper, taken to be plausible",
    "derived": "follows from printed numbers", "printed": "stands in the paper",
}  # fmt: skip
SCRIPTS = ("shared", "page")  # one module, in this order
COLOURS_OF_A_PICTURE = 16
FRONT = ("fig24", "trade")  # on the first screen
# of the gallery, each folded under its title
GROUPS = {
    "Figures 1 to 13: the model in drawings": [f"fig{number:02d}" for number in range(1, 14)],
    "Figures 14 to 23: results": [f"fig{number:02d}" for number in range(14, 24)],
    "Tables": [item.key for item in PAPER if item.table],
}
# tables whose files the page hands out; the first folder that has one
TABLES = (
    "claims.csv", "metrics.csv", "trade.csv", "planner.csv", "extremes.csv", "tables/fidelity.csv",
    "tables/parameters.csv", "tables/extremes.csv", "tables/extremes_short_runs.csv",
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
) -> str:
    """The page as HTML text.

    Parameters
    ----------
    results : path
        Folder that the workflow wrote.
    synthetic : bool or None
        Whether the sensor's records are synthetic; None: there are none.
    layers : sequence of str
        Configurations on top of the base, which commands on the page must name.
    studies : sequence of str
        Made by this run; what else lies in the folder is of an earlier one, and said to be.
    short : str
        How the run is shorter than the paper's; empty: it is not.
    own : bool
        Whether the rig is another one than that which was fitted to the paper.
    plausible : mapping or None
        Files of the study of plausible tracks: ``sentences``, ``claims``; None for another rig than the paper's.
    """
    recordings = check_sources(sorted((results / "runs").rglob("*.npz")))
    files = {name: path.read_text(encoding="utf-8") for name in TABLES if (path := _first(results, name))}
    with ThreadPoolExecutor() as pool:  # most of the time is the packing of pictures, without the interpreter
        shown = list(pool.map(partial(_entry, results, synthetic, _said(results)), (*PAPER, *OF_STUDIES)))
    return render(
        "page.html.j2",
        SCRIPTS,
        {"files": files},
        Path(__file__).parent,
        card=_card(results, own, plausible),
        short=short,
        own=own,
        sensor=[row for row in _rows(results, "tables/table3.csv") or [] if "rms_sensor_g" in row] if own else [],
        answer_costs=trade_sentence(pd.read_csv(planner)) if (planner := _first(results, "planner.csv")) else "",
        symbols=MARKS,
        synthetic=synthetic,
        parameters=_parameters(results),
        kinds=KINDS,
        fidelity=_rows(results, "tables/fidelity.csv"),
        planner=_promises(_rows(results, "planner.csv")),
        recordings=recordings,
        version=__version__,
        sources=source_hash(),
        gallery=[entry for entry in shown if entry["item"] in PAPER and entry["item"].key not in FRONT],
        extremes=[entry for entry in shown if entry["item"].key.startswith("extremes")],
        front=[entry for entry in shown if entry["item"].key in FRONT and entry["pictures"]],
        judged=JUDGED,
        groups=GROUPS,
        missing=missing_items(results),
        forms={name: _form(results, study.file, name in studies) for name, study in STUDIES.items()},
        layers=" ".join(["", "--configfile", *layers]) if layers else "",
        paper_items=len(PAPER),
    )


def _card(results: Path, own: bool, plausible: Mapping[str, str] | None) -> dict | None:
    """The scorecard: results for every rig, and all parts, those that are judged first."""
    path = results / "claims.csv"
    if not path.is_file():
        return None
    card, parameters = pd.read_csv(path, dtype=str, keep_default_na=False), results / "tables" / "parameters.csv"
    judged = pd.read_csv(results / "sentences.csv")
    rigs = list(dict.fromkeys(card["rig"]))
    parts = [
        rows.iloc[0].to_dict() | {"rigs": rows[["rig", "measured", "verdict", "reason"]].to_dict("records")}
        for _, rows in card.groupby(["id", "part"], sort=False)
    ]
    parts.sort(key=lambda statement: all(row["verdict"] not in JUDGED for row in statement["rigs"]))
    sizes = card.groupby(["verdict", "rig"]).size()
    shares = {name: pd.read_csv(path, dtype={"name": str}) for name, path in (plausible or {}).items()}
    return {
        "rigs": rigs,
        "statements": statements(card).to_dict("records"),
        "answer": answer_sentences(card, judged, pd.read_csv(parameters), shares.get("claims"), own)
        if parameters.is_file()
        else [],
        "headlines": {rig: headline(judged, rig) for rig in rigs},
        "counts": {verdict: " / ".join(str(sizes.get((verdict, rig), 0)) for rig in rigs) for verdict in VERDICTS},
        "parts": parts,
        "sentences": judged_sentences(judged, rigs[0], shares.get("sentences")),
    }


def _first(results: Path, name: str) -> Path | None:
    """A file of a full study, else of its short form."""
    return next((path for folder in (results, results / "short") if (path := folder / name).is_file()), None)


def _form(results: Path, name: str, now: bool) -> str:
    """What to know of the study that a file is of: whether it is its short form, and of an earlier run."""
    path = _first(results, name)
    words = ["short study"] if path and path.is_relative_to(results / "short") else []
    return ", ".join(words if now or path is None else [*words, "of an earlier run"])


def _rows(results: Path, name: str) -> list[dict] | None:
    """Rows of a CSV file with None for empty cells; None if the file does not exist."""
    if not (path := _first(results, name)):
        return None
    table = pd.read_csv(path)
    return table.astype(object).where(table.notna(), None).to_dict("records")


def _promises(rows: list[dict] | None) -> list[dict] | None:
    """Rows of the planner's promises in words."""
    return rows and [row | {"measure": "{} ({})".format(*MEASURES[row["measure"]])} for row in rows]


def _parameters(results: Path) -> dict[str, list[dict]] | None:
    rows = _rows(results, "tables/parameters.csv")
    return None if rows is None else {kind: [row for row in rows if row["kind"] == kind] for kind in KINDS}


def _said(results: Path) -> dict[str, list[str]]:
    """What the paper's text says of a figure or table, by its label, and whether the first rig shows it."""
    path = results / "claims.csv"
    sentences: dict[str, list[str]] = {}
    if path.is_file():
        card = pd.read_csv(path)
        for _, row in card[(card["rig"] == card["rig"].iloc[0]) & card["verdict"].isin(JUDGED)].iterrows():
            for kind, numbers in re.findall(r"(Fig|Table)s?\.? ([\d, ]+)", row["place"]):
                for number in re.findall(r"\d+", numbers):
                    label = f"{'Figure' if kind == 'Fig' else kind} {number}"
                    sentences.setdefault(label, []).append(f"{row['claim']} ({row['verdict']})")
    return sentences


def _entry(results: Path, synthetic: bool | None, said: Mapping[str, list[str]], item) -> dict:
    files = item.files(results) or item.files(results / "short")
    paragraph = [f"The text says: {'; '.join(said[item.label])}."] if item.label in said else []
    return {
        "item": item,
        "id": item.key if item.label else f"our-{item.key}",
        "said": _caption_html(paragraph),
        "caption": _caption_html([*item.caption(synthetic), *paragraph]),
        "pictures": [] if item.table else [embedded_picture(file) for file in files],
        "rows": _rows(files[0].parent, files[0].name) if item.table and files else None,
    }


def _caption_html(paragraphs: list[str]) -> str:
    """Paragraphs of plain text with names in backquotes as HTML."""
    text = "\n".join(f"<p>{html.escape(paragraph, quote=False)}</p>" for paragraph in paragraphs)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def embedded_picture(path: Path) -> dict:
    """A picture as a data address with its size in pixels, with the few colours that line drawings need."""
    rare = Image.Quantize.MAXCOVERAGE  # keeps the colour of a few marks; a median cut makes them grey
    with Image.open(path) as image:
        few = image.convert("RGB").quantize(COLOURS_OF_A_PICTURE, rare, dither=Image.Dither.NONE).convert("RGB")
    buffer = io.BytesIO()
    few.save(buffer, format="WEBP", lossless=True, quality=75)
    uri = "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
    letter = path.stem.rpartition("_")[2]
    label = f", part {letter}" if len(letter) == 1 else ""
    return {"uri": uri, "width": few.width, "height": few.height, "part": label}


def main(job) -> None:
    """Rule `page`."""
    of = job.params
    page = build_page(Path(of.results), of.synthetic, of.layers, of.studies, of.short, of.own, of.plausible)
    write_text(job.output[0], page)
    for item in missing_items(of.results):
        print(f"missing: {item.label}, {item.title} (rule {item.rule})")


if __name__ == "__main__":
    run_job(main)
