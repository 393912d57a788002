"""Put the page together from what lies in the results folder; what is missing is named, not left blank."""

import base64
import html
import io
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from PIL import Image
from plotly.offline import get_plotlyjs

from trackdyn import load_recording, load_rig
from trackdyn.measure.sensor_csv import read_sensor_csv
from trackdyn.paper.claims import ORIGINS, VERDICTS, headline
from trackdyn.paper.contents import OWN, PAPER, missing
from trackdyn.replacing import replacing
from trackdyn.report.page import data
from trackdyn.report.page.provenance import check_sources, provenance

HERE = Path(__file__).parent
# what is uncertain comes first
KINDS = {
    "fitted": "chosen so that the model shows a printed result",
    "assumed": "not in the paper, taken to be plausible",
    "derived": "follows from printed numbers",
    "printed": "stands in the paper",
}
SYMBOLS = dict(zip(VERDICTS, ("●", "◐", "○", "◇", "–"), strict=True))
COLOURS_OF_A_PICTURE = 128
# endings of column names; the longer ones first
UNITS = {
    "s_per_s": "s/s", "pct": "%", "rpm": "rev/min", "deg": "deg", "hz": "Hz", "mm": "mm", "mb": "MB", "us": "µs",
    "ms": "ms", "s": "s", "g": "g", "n": "N", "m": "m",
}  # fmt: skip


@dataclass(frozen=True)
class PageInputs:
    """What the page is made from.

    Attributes
    ----------
    results : Path
        Folder that the workflow wrote.
    rig : Path
        The rig's file, for the list of parameters and the geometry of the moving picture.
    sensors : mapping
        Run such as ``115rpm`` to the sensor's record.
    synthetic : bool
        Whether these records are synthetic.
    files : tuple of path
        Configuration and data whose hashes are listed.
    sources : str, optional
        Hash that every recording must carry; that of the present program if not given.
    """

    results: Path
    rig: Path
    sensors: Mapping[str, Path] = field(default_factory=dict)
    synthetic: bool = True
    files: tuple[Path, ...] = ()
    sources: str | None = None


def build_page(inputs: PageInputs) -> str:
    """The page as HTML text.

    Raises
    ------
    InputError
        If a recording in the folder was made by another version of the program.
    """
    results = Path(inputs.results)
    metas = check_sources(sorted((results / "runs").rglob("*.npz")), inputs.sources)
    embedded = {
        "geometry": data.geometry(load_rig(inputs.rig)),
        "signals": _signals(inputs),
        "sensor_label": "synthetic sensor" if inputs.synthetic else "sensor",
        "passages": _recordings(results, "meshing", data.passage),
        "pictures": _recordings(results, "animation", data.moving_picture),
        "ring": _ring(results),
        "trade": _first(results, "trade.csv", "short/trade.csv"),
    }
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"cell": _cell, "heading": _heading}
    return environment.get_template("page.html.j2").render(
        style=(HERE / "page.css").read_text(encoding="utf-8"),
        scripts=[(HERE / f"{name}.js").read_text(encoding="utf-8") for name in ("page", "charts", "animation")],
        plotly=get_plotlyjs(),
        # a closing tag within the data would end the script
        embedded=json.dumps(embedded, allow_nan=False).replace("</", "<\\/"),
        data=embedded,
        card=_card(results),
        symbols=SYMBOLS,
        synthetic=inputs.synthetic,
        parameters=_parameters(results),
        kinds=KINDS,
        costs=data.rows_of(results / "tables" / "costs.csv"),
        fidelity=_first(results, "tables/fidelity.csv"),
        provenance=provenance(metas, [inputs.rig, *inputs.files, *inputs.sensors.values()]),
        gallery=[_entry(inputs, item) for item in (*PAPER, *(own for own in OWN if not own.table))],
        missing=missing(results),
        paper_items=len(PAPER),
    )


def write_page(inputs: PageInputs, path: Path | str) -> None:
    """Write the page, whole or not at all."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(build_page(inputs), encoding="utf-8")


def _signals(inputs: PageInputs) -> dict:
    shown = {}
    for run, path in inputs.sensors.items():
        file = Path(inputs.results) / "runs" / f"{run}.npz"
        if file.is_file():
            recording = load_recording(file)
            record = read_sensor_csv(path, range_g=float("inf")) if Path(path).is_file() else None
            shown[run] = data.signals(recording, record)
    return shown


def _card(results: Path) -> dict | None:
    """The scorecard: a headline and counts of verdicts for every rig, and the parts of the claims, open tests first."""
    path = results / "claims.csv"
    if not path.is_file():
        return None
    card = pd.read_csv(path, dtype=str, keep_default_na=False)
    rigs = list(dict.fromkeys(card["rig"]))
    parts = [
        rows.iloc[0].to_dict() | {"rigs": rows[["rig", "measured", "verdict", "reason"]].to_dict("records")}
        for _, rows in card.groupby(["id", "part"], sort=False)
    ]
    counts = card.groupby(["verdict", "rig"]).size()
    return {
        "rigs": rigs,
        "headlines": {rig: headline(card, rig) for rig in rigs},
        "counts": {one: " / ".join(str(counts.get((one, rig), 0)) for rig in rigs) for one in VERDICTS},
        "parts": sorted(parts, key=lambda part: (*ORIGINS, "").index(part["origin"])),
    }


def _recordings(results: Path, folder: str, make) -> list[dict]:
    shown = [make(load_recording(path)) for path in sorted((results / "runs" / folder).glob("*.npz"))]
    return sorted(shown, key=lambda one: (one["rpm"], one["radius"] or 0.0))


def _ring(results: Path) -> dict | None:
    path = results / "metrics.csv"
    return data.ring_study(pd.read_csv(path)) if path.is_file() else None


def _first(results: Path, *names: str) -> list[dict] | None:
    """Rows of the first of some files that exists."""
    return next((rows for name in names if (rows := data.rows_of(results / name)) is not None), None)


def _parameters(results: Path) -> dict[str, list[dict]] | None:
    rows = data.rows_of(results / "tables" / "parameters.csv")
    return None if rows is None else {kind: [row for row in rows if row["kind"] == kind] for kind in KINDS}


def _entry(inputs: PageInputs, item) -> dict:
    files = item.files(inputs.results)
    return {
        "item": item,
        "caption": _caption_html(item.caption(inputs.synthetic)),
        "pictures": [] if item.table else [{"name": f.stem, "uri": picture_uri(f)} for f in files],
        "rows": data.rows_of(files[0]) if item.table and files else None,
    }


def _caption_html(paragraphs: list[str]) -> str:
    """Paragraphs of plain text with names in backquotes as HTML."""
    text = "\n".join(f"<p>{html.escape(paragraph, quote=False)}</p>" for paragraph in paragraphs)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def picture_uri(path: Path) -> str:
    """A picture as a data address, with the few colours that line drawings need."""
    with Image.open(path) as image:
        few = image.convert("RGB").quantize(COLOURS_OF_A_PICTURE, dither=Image.Dither.NONE)
    buffer = io.BytesIO()
    few.save(buffer, format="PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _heading(column: str) -> str:
    """Name of a column with its unit in brackets."""
    for ending, unit in UNITS.items():
        if column.endswith(f"_{ending}"):
            return f"{column.removesuffix(f'_{ending}').replace('_', ' ')} ({unit})"
    return column.replace("_", " ")


def _cell(value) -> str:
    """A cell as text: five significant digits, a dash for nothing."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}".replace("-", "\N{MINUS SIGN}") if isinstance(value, float) else str(value)
