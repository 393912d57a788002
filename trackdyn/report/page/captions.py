"""Captions: short texts in reStructuredText, shared by the page and the workflow's own report."""

from pathlib import Path

from docutils.core import publish_parts
from docutils.writers.html5_polyglot import Writer

SETTINGS = {
    "file_insertion_enabled": False,
    "raw_enabled": False,
    "report_level": 5,
    "initial_header_level": 4,
    "syntax_highlight": "none",
    "math_output": "MathML",
}


def caption_html(folder: Path | str, key: str) -> str:
    """Caption of a figure or table as HTML; empty if there is none."""
    path = Path(folder) / f"{key}.rst"
    if not path.is_file():
        return ""
    text = path.read_text(encoding="utf-8")
    return publish_parts(text, writer=Writer(), settings_overrides=SETTINGS)["body"].strip()
