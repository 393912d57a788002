"""Style of all figures, and reproducible files of them."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from trackdyn.inputs.files import replacing

WIDTH, PAGE = 4.8, 7.2  # widths, inch: of a figure, legible in a column of 84 mm; of pictures that fill a page
COLUMN = 3.3  # width of a figure that a column, a phone or a third of a web page shows in its own size, inch
DPI, SCREEN_DPI = 270, 135  # dots an inch: for print; for a screen, with a quarter of the pixels to draw and pack
SMALL = 7  # no text is smaller, points: 4.8 in a column of 84 mm

# They differ in lightness, so that prints in grey and readers who are blind to a colour tell them apart:
# L* of 0, 27, 54 and 71 in COLOURS; PURPLE is as light as VERMILION, GREEN as light as ORANGE.
BLACK, BLUE, VERMILION, ORANGE = "#000000", "#00407A", "#D55E00", "#E69F00"
PURPLE, GREEN = "#C8569B", "#4FBF8B"
COLOURS = (BLACK, BLUE, VERMILION, ORANGE)
DASHES = ("-", (0, (5, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (1, 1)))
MARKERS = ("o", "s", "^", "D")

SIMULATION = {"color": BLUE, "linestyle": "-"}
SENSOR = {"color": ORANGE, "linestyle": "-"}
PRINTED = {"color": BLACK, "linestyle": (0, (6, 2))}

RC = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=COLOURS, linestyle=DASHES),
    "axes.titlelocation": "left",
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.5,
    "legend.framealpha": 0.9,
    "legend.handlelength": 1.8,
    "legend.columnspacing": 1.2,
    "lines.linewidth": 1.0,
    "lines.markersize": 4,
    "savefig.dpi": DPI,
    "svg.hashsalt": "trackdyn",
    **dict.fromkeys(("font.size", "axes.labelsize", "axes.titlesize", "figure.titlesize"), 8),
    **dict.fromkeys(("legend.fontsize", "xtick.labelsize", "ytick.labelsize"), SMALL),
}


def styled(draw: Callable) -> Callable:
    """Decorate a function that draws, to use this style whatever the user's own settings."""

    @wraps(draw)
    def wrapper(*args, **kwargs):
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(RC)
            return draw(*args, **kwargs)

    return wrapper


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure of a height and a width in inches, without a window."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


# neither date nor version: the same data give the same bytes
PLAIN: dict[str, dict[str, Any]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}


@styled
def save(figure: Figure, path: Path | str, *kinds: str, dpi: float = DPI) -> None:
    """Write a figure in every format, ``png`` and ``svg`` by default: all or none.

    It is laid out once, with rounded positions of axes: the solver's last digits differ from call to call. With a
    layout engine, also with ``"none"``, `savefig` would draw everything twice; afterwards it takes that of the style.
    """
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
        for axes in figure.axes:
            axes.set_position(np.round(axes.get_position(original=True).bounds, 9).tolist())
    with mpl.rc_context({"figure.constrained_layout.use": False}), ExitStack() as files:
        figure.set_layout_engine(None)
        for kind in kinds or PLAIN:
            file = files.enter_context(replacing(Path(path).with_suffix(f".{kind}")))
            figure.savefig(file, format=kind, dpi=dpi, metadata=PLAIN[kind])


def power_of_ten(value: float, digits: int) -> str:
    """Format a number as 3.00 × 10⁻¹⁴ with ``digits`` after the point; 0 as such."""
    if not value:
        return "0"
    mantissa, exponent = f"{value:.{digits}e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa} × 10{raised}".replace("-", "\N{MINUS SIGN}")


def upper_edge(y, groups: int) -> tuple[np.ndarray, np.ndarray]:
    """Divide a curve into groups; return their first indices with the end, and the largest value in each."""
    edges = np.unique(np.linspace(0, len(y), min(groups, len(y)) + 1).astype(int))
    return edges, np.maximum.reduceat(y, edges[:-1])


def thin(x, y, groups: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Thin a long curve, whose ``x`` rises, to the extremes of each of ``groups`` intervals, which looks the same."""
    x, y = np.asarray(x), np.asarray(y)
    if len(x) <= 2 * groups:
        return x, y
    edges = np.linspace(0, len(x), groups + 1).astype(int)
    keep = np.unique([[a + np.argmin(y[a:b]), a + np.argmax(y[a:b])] for a, b in pairwise(edges)])
    return x[keep], y[keep]
