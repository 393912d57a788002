"""Measures of a run as a table (`metrics.shown_measures`); apart, since runs need no pandas."""

import pandas as pd

from trackdyn.inputs.validation import typed
from trackdyn.measure.metrics import shown_measures
from trackdyn.simulation.recording import Recording

NUMBERS = ["value", "error", "half_width"]


class Measures(pd.DataFrame):
    """Table of measures that prints all rows and columns."""

    def __repr__(self) -> str:
        return self.to_string(float_format="{:.5g}".format, na_rep="-")

    __str__ = __repr__


@typed
def measures(recording: Recording) -> pd.DataFrame:
    """Return the measures of a run, such as ``measures(recording).loc["rms_g", ["value", "error"]]``.

    One row per measure with its name as index, such as ``rms_g`` or ``left_share_pct``, and the columns ``value``,
    ``error`` (standard error of scatter and step), ``half_width`` (half of the 95 % interval), both NaN if unknown,
    ``unit`` and ``measure``, a description. Measures are RMS, SD and lines of the acceleration; contact durations and
    peaks of the sprocket's arcs and the ring, if the scene logs contacts; sliding work. Measures that need a longer
    run are left out. A rig with several sensors has one row per measure of the acceleration and sensor, whose name is
    in one more column, ``sensor``.
    """
    table = pd.DataFrame(shown_measures(recording)).set_index("name")
    return Measures(table.astype(dict.fromkeys(NUMBERS[1:], float))[[*NUMBERS, "unit", "measure", *table.columns[5:]]])
