"""The measures of a run as a table (`metrics.shown_measures`): with pandas, half a second that a run does without."""

import pandas as pd

from trackdyn.inputs.validation import typed
from trackdyn.measure.metrics import shown_measures
from trackdyn.simulation.recording import Recording

KNOWN = ["value", "error", "half_width"]


class Measures(pd.DataFrame):
    """A table of measures; as text it holds all rows and columns."""

    def __repr__(self) -> str:
        return self.to_string(float_format="{:.5g}".format, na_rep="-")

    __str__ = __repr__


@typed
def measures(recording: Recording) -> pd.DataFrame:
    """Return the measures of a run, such as ``measures(recording).loc["rms_g", ["value", "error"]]``.

    One row a measure by its name, such as ``rms_g`` or ``left_share_pct``, with the columns ``value``, ``error``
    (standard error of scatter and step), ``half_width`` (half of the 95 % interval), both NaN where they are not known,
    ``unit`` and ``measure``, a description. RMS, SD and lines of the acceleration; contact durations and peaks of the
    sprocket's arcs and the ring, if the scene logs contacts; sliding work, if all links are logged. What the run is too
    short for is left out. A rig with several sensors gives RMS, SD and lines of each, a row each with its name in one
    more column, ``sensor``.
    """
    table = pd.DataFrame(shown_measures(recording)).set_index("name")
    return Measures(table.astype(dict.fromkeys(KNOWN[1:], float))[[*KNOWN, "unit", "measure", *table.columns[5:]]])
