"""Objects as a notebook shows them."""

from collections.abc import Mapping
from html import escape


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return a table of two columns, names and words, as HTML."""
    cells = (
        f'<tr><th style="text-align:left">{escape(name)}</th><td>{escape(text)}</td></tr>'
        for name, text in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption><tbody>{''.join(cells)}</tbody></table>"
