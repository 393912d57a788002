"""Cells of the page's tables as text."""

import re
from math import floor, log10

from trackdyn.measure.columns import groups, heading, words
from trackdyn.report.tables import significant


def cell(value, digits: int = 3) -> str:
    """A cell as text, as in the Markdown tables (`tables.significant`), with a proper minus."""
    text = significant(value, digits)
    return text.replace("-", "\N{MINUS SIGN}") if isinstance(value, float) else text


def with_error(value: float | None, error: float | None) -> str:
    """A value as far as its standard error reaches, which has two digits, up to eight decimals: 44.2511 ± 0.0013."""
    if value is None or not error:
        return cell(value)
    decimals = min(8, max(0, 1 - floor(log10(error))))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def change(value: float | None) -> str:
    """A difference in percent: two decimals, or three digits of a large one; a dash for nothing."""
    if value is None:
        return "–"
    text = f"{value:+.2f}" if abs(value) < 10 else f"{value:+.3g}" if abs(value) < 1000 else f"{value:+.0f}"
    return "0" if float(text) == 0 else text.replace("-", "\N{MINUS SIGN}")


def span(text: str) -> str:
    """The numbers of a text, three digits each: one, two, or the least and the largest of more."""
    text = re.sub(r" at \d+(?: rpm)?", "", text)  # the speeds that the numbers are of
    found = sorted({float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)})
    if not found:
        return text
    ends = found if len(found) < 3 else [found[0], found[-1]]
    return " to ".join(dict.fromkeys(cell(value) for value in ends))


FILTERS = {made.__name__: made for made in (cell, change, groups, heading, span, words)}  # of the templates
