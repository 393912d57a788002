"""Cells of the page's tables as text."""

import re
from math import floor, log10

import numpy as np

from trackdyn.measure.columns import groups, heading, words
from trackdyn.measure.convergence import ROUNDING


def significant(value, digits: int = 3) -> str:
    """A cell as text: so many significant digits, zeros among them; an exponent for the very small and large only.

    Numbers that need fewer digits have no more, whole numbers keep theirs, text stays as it is, nothing is a dash.
    """
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if value is None or value != value or value == "":
        return "–"
    if not isinstance(value, float) or not np.isfinite(value):
        return str(value)
    if value and not 1e-4 <= abs(value) < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    short = f"{value:.{digits}g}"
    return short if float(short) == value else f"{value:#.{digits}g}".rstrip(".")


def cell(value, digits: int = 3) -> str:
    """A cell as text, as in the Markdown tables (`significant`), with a proper minus."""
    text = significant(value, digits)
    return text.replace("-", "\N{MINUS SIGN}") if isinstance(value, float) else text


def with_error(value: float | None, error: float | None) -> str:
    """A value as far as its standard error reaches, which has two digits, up to eight decimals: 44.2511 ± 0.0013."""
    if value is None or not (error or 0.0) > ROUNDING * abs(value):
        return cell(value)
    decimals = min(8, max(0, 1 - floor(log10(error))))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def change(value: float | None) -> str:
    """A difference in percent: two decimals, or three digits of a large one; a dash for nothing."""
    if value is None:
        return "–"
    text = f"{value:+.2f}" if abs(value) < 10 else f"{value:+.3g}" if abs(value) < 1000 else f"{value:+.0f}"
    return "0" if float(text) == 0 else text.replace("-", "\N{MINUS SIGN}")


def number_span(text: str) -> str:
    """The numbers of a text, three digits each: one, two, or the least and the largest of more."""
    text = re.sub(r" at \d+(?: rpm)?", "", text)  # the speeds that the numbers are of
    numbers = sorted({float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)})
    if not numbers:
        return text
    ends = numbers if len(numbers) < 3 else [numbers[0], numbers[-1]]
    return " to ".join(dict.fromkeys(cell(value) for value in ends))


FILTERS = {made.__name__: made for made in (cell, change, groups, heading, number_span, words)}  # of the templates
