"""The site: `make docs` builds it from these pages, the docstrings and what the command says of itself."""

import json
import os
import subprocess
import sys
from base64 import b64decode
from pathlib import Path

from trackdyn import __version__
from trackdyn.commands.cli import app
from trackdyn.measure.columns import COLUMNS, TABLES

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
exclude_patterns = ["README.md", "_site", "measured/*", "_generated/thumbnails.md"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
# files of the repository that pages link to are no pages of the site
suppress_warnings = ["myst.xref_missing"]
html_theme = "pydata_sphinx_theme"
html_title = "trackdyn"
html_theme_options = {"show_nav_level": 2, "secondary_sidebar_items": ["page-toc"], "use_edit_page_button": False}
html_copy_source = False
napoleon_google_docstring = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"


def commands() -> str:
    """The help of every command, as it is printed."""
    environment = os.environ | {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
    parts = ["# Commands\n"]
    names = [command.callback.__name__.replace("_", "-") for command in app.registered_commands]
    for name in ("", *names, *(group.name for group in app.registered_groups)):
        line = [sys.executable, "-m", "trackdyn", *([name] if name else []), "--help"]
        said = subprocess.run(line, capture_output=True, text=True, check=True, env=environment, cwd=ROOT).stdout
        heading = f"trackdyn {name}".strip()
        parts.append(f"## {heading}\n\n```text\n{said.strip()}\n```\n")
    return "\n".join(parts)


def columns() -> str:
    """The columns of the published tables."""
    lines = ["# Columns of published tables", ""]
    for table, described in {"metrics": COLUMNS, **{name: columns for name, (_, columns) in TABLES.items()}}.items():
        rows = [f"| `{name}` | {unit} | {text} |" for name, (_, unit, text, *_) in described.items()]
        lines += [f"## {table}.csv", "", "| column | unit | meaning |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def gallery_page(path: Path, place: Path) -> str:
    """A notebook as a page: its text, its code and the outputs that are kept in it, pictures beside the page."""
    parts = []
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"]):
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in data:
                picture = place / f"{path.stem}_{number}.png"
                picture.write_bytes(b64decode(data["image/png"]))
                parts.append(f"![Output of the code above]({picture.name})")
            else:
                parts.append(f"```text\n{''.join(data['text/plain']).rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def thumbnails(place: Path) -> str:
    """The last picture of every page of the gallery, linked to it."""
    pictures = {path.stem.rpartition("_")[0]: path.name for path in sorted(place.glob("*.png"))}
    one = "```{{image}} _generated/gallery/{1}\n:target: _generated/gallery/{0}.html\n:alt: {0}\n:width: 15rem\n```"
    return "\n".join(one.format(page, name) for page, name in pictures.items())


def write_pages(_) -> None:
    """Pages that the program writes about itself, and the notebooks of the gallery."""
    place = ROOT / "docs" / "_generated"
    (place / "gallery").mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "docs" / "gallery").glob("*.ipynb")):
        page = gallery_page(path, place / "gallery")
        (place / "gallery" / f"{path.stem}.md").write_text(page, encoding="utf-8")
    (place / "thumbnails.md").write_text(thumbnails(place / "gallery"), encoding="utf-8")
    for make in (commands, columns):
        (place / f"{make.__name__}.md").write_text(make(), encoding="utf-8")


def setup(app) -> None:
    app.connect("builder-inited", write_pages)
