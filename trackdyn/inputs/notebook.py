"""Objects as a notebook shows them."""

from collections.abc import Mapping
from html import escape


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return a table of two columns, names and words, as HTML."""
    row = '<tr><th style="text-align:left">{}</th><td>{}</td></tr>'.format
    cells = "".join(row(escape(name), escape(text)) for name, text in rows.items())
    return f"<table><caption>{escape(title)}</caption><tbody>{cells}</tbody></table>"
