"""How a run's measures are taken (`measure.catalogue`): of a sensor's record, and of contacts with the sprocket."""

from collections.abc import Callable
from functools import partial

import numpy as np

from trackdyn.measure import spectra
from trackdyn.measure.catalogue import ACCELERATION, OF_SIDES
from trackdyn.measure.contacts import passage_arrays, sampled_shares
from trackdyn.measure.sensor import measured_loop_hz, whole_revolutions
from trackdyn.measure.uncertainty import NAN, LineError, Series, line_error, ratio_values, turn_edges, turn_error
from trackdyn.simulation.recording import Recording

# Areas that an arc visits for less than this share of a turn a passage do not count in the summary, %.
LEAST_TOUCH_PCT = 0.1


class Sensed:
    """What measures of a y acceleration ay (g) are taken from, each with its standard error over whole revolutions.

    A record of less than one revolution is taken as it is. Lines and errors are NaN where it holds fewer than two.
    """

    def __init__(self, ay, rate: float, loop_hz: float) -> None:
        self.ay, self.rate, self.loop_hz = np.asarray(ay), rate, loop_hz
        self.turns = self.ay[: whole_revolutions(len(self.ay), rate, loop_hz)]
        self.has_line = spectra.holds_line(len(self.ay), rate, loop_hz) and bool(np.ptp(self.ay))
        self.bin, self.line, self.line_errors = (NAN, NAN), (NAN, NAN), LineError(NAN, NAN, NAN, NAN, NAN)
        if self.has_line:
            self.bin = spectra.main_line(self.ay, rate, loop_hz)
            # a sample more: two turns are the least that has a line, and end between two samples
            hz, amplitude = spectra.main_line_binfree(self.ay[: len(self.turns) + 1], rate, expected_hz=loop_hz)[:2]
            self.line_errors = line_error(self.ay, rate, self.bin[0], hz)
            # harmonics beyond the fitted ones move the fit, by the phase at which a record begins, but no turn's phase
            self.line = hz + self.line_errors.beyond_hz, amplitude

    rms, sd, mean = staticmethod(spectra.rms), staticmethod(spectra.standard_deviation), staticmethod(np.mean)

    def of(self, statistic: Callable[[np.ndarray], float]) -> tuple[float, float]:
        """A statistic of the whole revolutions, since parts of a turn differ."""
        error = turn_error(self.ay, 1 / self.loop_hz * self.rate, statistic) if self.has_line else NAN
        return float(statistic(self.turns)), error

    def degrees(self, column: str) -> int:
        """Degrees of freedom of the standard error of a column: whole turns less what is fitted to them."""
        turns = len(turn_edges(len(self.ay), self.rate / self.loop_hz)) - 1 if self.loop_hz else 0
        return max(turns - (2 if column == "line_hz_binfree" else 1), 0)

    def high_frequency(self) -> tuple[float, float]:
        """RMS from 20 Hz on."""
        value, error = self.of(partial(spectra.high_frequency_rms, rate_hz=self.rate))
        below_a_revolution = len(self.ay) / self.rate * self.loop_hz < 1
        return spectra.rms(spectra.high_passed(self.ay, self.rate)) if below_a_revolution else value, error


def sensor_metrics(ay, rate: float, loop_hz: float) -> dict:
    """Columns of the `catalogue` about the y acceleration ay in g, each before its standard error (`Sensed`)."""
    sensed, row = Sensed(ay, rate, loop_hz), {}
    for measure in (measure for measure in ACCELERATION if measure.text):
        row[measure.column], row[measure.error] = measure.sensed(sensed)
    return row


def record_metrics(ay, rate: float, expected_hz: float) -> dict:
    """`sensor_metrics` of a record ``ay`` whose loop turns at a speed of its own, near ``expected_hz`` (Hz)."""
    return sensor_metrics(ay, rate, measured_loop_hz(ay, rate, expected_hz))


def contact_series(table: dict[str, np.ndarray], loop: float) -> dict[str, Series]:
    """Measures of each side passage by passage, by columns of a run such as ``left_share_pct``; without NaN.

    ``table`` is that of `passage_arrays`, ``loop`` the time of a revolution of the loop, s.
    """
    count, measures = len(table["passage"]), dict[str, Series]()
    for k, of_side in enumerate(OF_SIDES.values()):
        rows = {name: column[:, k] for name, column in table.items()}
        force, square = rows["impulse_ns"] / loop, rows["square_n2s"] / loop
        mean = force.sum() / max(count, 1)
        rows |= {"square_n2": square, "variance_n2": square - 2 * mean * force + mean**2}
        rows["square_in_contact_n2"] = ratio_values(rows["square_n2s"], rows["touching_s"])
        for measure in of_side:
            values = measure.visits(rows)
            known = values[~np.isnan(values)]
            measures[measure.column] = Series(known, np.arange(len(known)), measure.root)
    return measures


def meshing_summary(recording: Recording) -> dict:
    """Shares, phases and forces of a run, as means over its complete passages, with standard errors by batch means.

    Keys are those of `columns`: ``passages``, ``left_areas``, ``right_areas``, and those of each side.
    Forces over the run are those of an appointed connector (link), free running included as zero. The largest force of
    all has no standard error: what it estimates depends on how many passages it is the largest of (Coles, Introduction
    to Statistical Modeling of Extreme Values, 2001, ch. 3). Areas are those that the recorded connectors visit for
    0.1 % of a turn or more a passage. Without a complete passage all other numbers are NaN and areas empty; without a
    contact of the kind shares and forces are 0 and phases NaN.
    """
    table = passage_arrays(recording)
    count, series = len(table["passage"]), contact_series(table, recording.periods.loop)
    summary: dict = {"passages": count}
    for k, (side, measures) in enumerate(OF_SIDES.items()):
        for measure in measures:
            taken = series[measure.column]
            if measure.has_error:
                summary[measure.column], summary[measure.error], _ = taken.estimate()
            else:
                summary[measure.column] = float(taken.values.max()) if count else NAN
        if side != "ring":
            shares = sampled_shares(recording.area[:, :, k], recording.scene.rig)
            visited = ",".join(str(area) for area in range(1, 11) if shares[area] >= LEAST_TOUCH_PCT)
            summary[f"{side}_areas"] = (visited or "none") if count else ""
    return summary
