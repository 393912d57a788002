"""Cells of tables as text."""

from collections.abc import Sequence
from math import floor, log10

import numpy as np

from trackdyn.measure.uncertainty import ROUNDING


def significant(value, digits: int = 3) -> str:
    """Format a cell with significant digits, trailing zeros included, and an exponent for very small and large numbers.

    Numbers that need fewer digits have no more, whole numbers keep theirs, text is unchanged, None is a dash.
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
    """Format a cell (`significant`) with a proper minus."""
    text = significant(value, digits)
    return text.replace("-", "\N{MINUS SIGN}") if isinstance(value, float) else text


def plain(text: str) -> str:
    """Replace the characters of a cell that a terminal may lack."""
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{PLUS-MINUS SIGN}", "+-").replace("\N{EN DASH}", "-")


# errors behind a +-, in every output
HALF_WIDTH = "half of the 95 % interval, with the error of the step"
STANDARD_ERROR = "standard error (68 %), with the error of the step"


def with_error(value: float | None, error: float | None) -> str:
    """Format a value to the decimals of its error, which has two digits, up to eight: 44.2511 ± 0.0013."""
    if value is None or error is None or not error > ROUNDING * abs(value):
        return cell(value)
    decimals = min(8, max(0, 1 - floor(log10(error))))
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def listed(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``150, 180 and 210``."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
