"""The site: `make docs` builds it from these pages, the docstrings and the help of the command."""

import json
import os
import re
from base64 import b64decode
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pandas as pd
from sphinx.ext import autosummary

from trackdyn import __version__
from trackdyn.commands.cli import app
from trackdyn.measure.columns import TABLES

ROOT = Path(__file__).parents[1]
project = "trackdyn"
author = "trackdyn contributors"
release = version = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
]
root_doc = "index"
exclude_patterns = ["_site", "measured/*", "_generated/parts/*"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
# files of the repository that pages link to are no pages of the site
suppress_warnings = ["myst.xref_missing"]
html_theme = "pydata_sphinx_theme"
html_title = "trackdyn"
html_theme_options = {"show_nav_level": 2, "secondary_sidebar_items": ["page-toc"], "use_edit_page_button": False}
html_static_path = ["site/site.css"]
html_css_files = ["site.css"]
html_copy_source = False
napoleon_google_docstring = False
# summaries end with their sentence, and not at these
autosummary.WELL_KNOWN_ABBREVIATIONS += ("Eq.", "Eqs.", "Fig.", "Sect.", "Ref.")
autodoc_typehints = "none"
autodoc_member_order = "bysource"


def commands() -> str:
    """Return the help of every command."""
    os.environ |= {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
    parts = ["# Commands\n"]
    names = [command.callback.__name__.replace("_", "-") for command in app.registered_commands]
    for name in ("", *names):
        with redirect_stdout(StringIO()) as output:
            app([*name.split(), "--help"], prog_name="trackdyn", standalone_mode=False)
        heading = f"trackdyn {name}".strip()
        parts.append(f"## {heading}\n\n```text\n{output.getvalue().strip()}\n```\n")
    return "\n".join(parts)


def columns() -> str:
    """Tabulate the columns of the published tables."""
    lines = ["# Columns of published tables", ""]
    for table, (_, described) in TABLES.items():
        rows = [f"| `{name}` | {unit} | {text} |" for name, (_, unit, text, *_) in described.items()]
        lines += [f"## {table}.csv", "", "| column | unit | meaning |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def gallery_page(path: Path, folder: Path) -> str:
    """Render a notebook as a page: its text, its code and its stored outputs; write its pictures into the folder."""
    parts = []
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in data:
                picture = folder / f"{path.stem}_{number}.png"
                picture.write_bytes(b64decode(data["image/png"]))
                parts.append(f"![Output of the code above]({picture.name})")
            else:
                parts.append(f"```text\n{''.join(data['text/plain']).rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def thumbnails(folder: Path) -> str:
    """Link the last picture of every page of the gallery, with its name, to it, in the order of its list."""
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \[(.+)\]\(gallery/(\w+)\.ipynb\)", page, re.MULTILINE)
    lines = ['<div class="thumbnails">']
    for words, page in listed:
        picture = max(folder.glob(f"{page}_*.png"), key=lambda path: int(path.stem.rpartition("_")[2]))
        address = f"_generated/gallery/{page}.html"
        shown = f'<img src="_images/{picture.name}" alt="">'
        lines.append(f'<a href="{address}">{shown}<br>{words}</a>')
    return "\n".join([*lines, "</div>"])


MARKS = {"met": "●", "not met": "○"}


def results() -> str:
    """Tabulate statements of the paper and the rig's values, a row per statement that can be judged."""
    card = pd.read_csv(ROOT / "docs" / "measured" / "claims.csv", keep_default_na=False)
    judged = card[card["verdict"].isin(MARKS)]
    rows = []
    for row in judged.to_dict("records"):
        unit = "" if row["unit"] == "1" or row["printed"] == "in words" else f" {row['unit']}"
        value = f"{MARKS[row['verdict']]} {row['measured']}"
        rows.append([f"{row['id']}{row['part']}", row["place"], row["claim"], f"{row['printed']}{unit}", value])
    heads = ["claim", "place", "statement", "paper", "default rig"]
    lines = [f"| {' | '.join(row)} |" for row in [heads, ["---"] * len(heads), *rows]]
    words = ", ".join(f"{mark} {verdict}" for verdict, mark in MARKS.items())
    return "\n".join([f"{words}; numbers of several speeds are in the order of speeds.", "", *lines, ""])


def equations() -> str:
    """Tabulate the equations, with names of functions and tests as code."""
    table = pd.read_csv(ROOT / "docs" / "equations.csv", keep_default_na=False)
    for name in ("functions", "tests"):
        table[name] = [" ".join(f"`{word}`" for word in cell.split()) for cell in table[name]]
    table["what"], table["status"] = (table[name].str.replace("|", "\\|") for name in ("what", "status"))
    table = table.rename(columns={"what": "content"})
    rows = [table.columns, ["---"] * len(table.columns), *table.to_numpy()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def write_pages(_) -> None:
    """Write the generated pages and parts, and the notebooks of the gallery."""
    pages = ROOT / "docs" / "_generated"
    for folder in ("gallery", "parts"):
        (pages / folder).mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "docs" / "gallery").glob("*.ipynb")):
        page = gallery_page(path, pages / "gallery")
        (pages / "gallery" / f"{path.stem}.md").write_text(page, encoding="utf-8")
    (pages / "parts" / "thumbnails.md").write_text(thumbnails(pages / "gallery"), encoding="utf-8")
    for make, folder in ((commands, pages), (columns, pages), (results, pages / "parts"), (equations, pages / "parts")):
        (folder / f"{make.__name__}.md").write_text(make(), encoding="utf-8")


def setup(app) -> None:
    app.connect("builder-inited", write_pages)
