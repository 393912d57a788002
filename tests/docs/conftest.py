"""Begin and end of a test that runs a page or a notebook: no open figure, whichever ran before it."""

import matplotlib
import pytest


@pytest.fixture
def pyplot():
    """``matplotlib.pyplot`` without a window and without figures."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    yield pyplot
    pyplot.close("all")
