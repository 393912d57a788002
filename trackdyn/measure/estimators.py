"""Estimators of measures (`measure.catalogue`) from a sensor's record and from contacts with the sprocket."""

from collections.abc import Callable
from functools import partial

import numpy as np

from trackdyn.measure import spectra
from trackdyn.measure.catalogue import ACCELERATION, OF_SIDES
from trackdyn.measure.contacts import passage_arrays, sampled_shares
from trackdyn.measure.sensor import whole_revolutions
from trackdyn.measure.uncertainty import NAN, LineError, Series, batch_degrees, line_error, ratio_values, turn_error
from trackdyn.simulation.recording import Recording

LEAST_TOUCH_PCT = 0.1  # share of a turn per passage, %, below which an area does not count as visited


class Sensed:
    """Estimators of a y acceleration ay (g), with standard errors over whole revolutions.

    A record of less than one revolution is used whole. Lines and errors are NaN for fewer than two.
    """

    def __init__(self, ay, rate: float, loop_hz: float) -> None:
        self.ay, self.rate, self.loop_hz = np.asarray(ay), rate, loop_hz
        self.turns = self.ay[: whole_revolutions(len(self.ay), rate, loop_hz)]
        self.has_line = spectra.holds_line(len(self.ay), rate, loop_hz) and bool(np.ptp(self.ay))
        self.bin, self.line, self.line_errors = (NAN, NAN), (NAN, NAN), LineError()
        if self.has_line:
            self.bin = spectra.main_line(self.ay, rate, loop_hz)
            # one more sample: two turns, which end between two samples, must suffice for a line
            hz, amplitude = spectra.main_line_binfree(self.ay[: len(self.turns) + 1], rate, expected_hz=loop_hz)[:2]
            self.line_errors = line_error(self.ay, rate, self.bin[0], hz)
            # harmonics beyond the fitted ones shift the fit, depending on its initial phase, but not phases of turns
            self.line = hz + self.line_errors.beyond_hz, amplitude

    rms, sd, mean = staticmethod(spectra.rms), staticmethod(spectra.standard_deviation), staticmethod(np.mean)

    def of(self, statistic: Callable[[np.ndarray], float]) -> tuple[float, float]:
        """Return a statistic of the whole revolutions, and its standard error."""
        error = turn_error(self.ay, 1 / self.loop_hz * self.rate, statistic) if self.has_line else NAN
        return float(statistic(self.turns)), error

    def degrees(self, column: str) -> int:
        """Return the degrees of freedom of the standard error of a column."""
        turns = int(len(self.ay) / self.rate * self.loop_hz + 1e-9)
        return max(turns - 2, 0) if column == "line_hz_binfree" else batch_degrees(turns)  # a line fitted to phases

    def high_frequency(self) -> tuple[float, float]:
        """Return the RMS at and above 20 Hz, and its standard error."""
        value, error = self.of(partial(spectra.high_frequency_rms, rate_hz=self.rate))
        below_a_revolution = len(self.ay) / self.rate * self.loop_hz < 1
        return spectra.rms(spectra.high_passed(self.ay, self.rate)) if below_a_revolution else value, error


def sensor_metrics(ay, rate: float, loop_hz: float) -> dict:
    """Return the columns of the `catalogue` of a y acceleration ay (g), each before its standard error (`Sensed`)."""
    sensed, row = Sensed(ay, rate, loop_hz), {}
    for column, estimator, _ in ACCELERATION:
        if column.text:
            row[column.name], row[column.error] = estimator(sensed)
    return row


def contact_series(table: dict[str, np.ndarray], loop: float) -> dict[str, Series]:
    """Return measures by passage, by columns of a run, from `passage_arrays` and the time of a loop revolution, s."""
    count, measures = len(table["passage"]), dict[str, Series]()
    for k, of_side in enumerate(OF_SIDES.values()):
        rows = {name: column[:, k] for name, column in table.items()}
        force, square = rows["impulse_ns"] / loop, rows["square_n2s"] / loop
        mean = force.sum() / max(count, 1)
        rows |= {"square_n2": square, "variance_n2": square - 2 * mean * force + mean**2}
        rows["square_in_contact_n2"] = ratio_values(rows["square_n2s"], rows["touching_s"])
        for column, passages, _ in of_side:
            values = rows[passages.values]
            values = values[~np.isnan(values)]
            measures[column.name] = Series(values, np.arange(len(values)), passages.root)
    return measures


def meshing_summary(recording: Recording) -> dict:
    """Return shares, phases and forces of a run, means over its complete passages with standard errors by batch means.

    Forces over the run are those of one connector (link), zero while it runs free. The largest force of all passages
    has no standard error, since its expectation depends on their number (Coles, Introduction to Statistical Modeling of
    Extreme Values, 2001, ch. 3). Areas are those that the recorded connectors visit for `LEAST_TOUCH_PCT`. Without a
    complete passage other numbers are NaN and areas empty; without contact shares and forces are 0 and phases NaN.
    """
    table = passage_arrays(recording)
    count, series = len(table["passage"]), contact_series(table, recording.periods.loop)
    summary: dict = {"passages": count}
    for k, (side, measures) in enumerate(OF_SIDES.items()):
        for column, *_ in measures:
            values = series[column.name]
            if column.has_error:
                summary[column.name], summary[column.error], _ = values.estimate()
            else:
                summary[column.name] = float(values.values.max()) if count else NAN
        if side != "ring":
            shares = sampled_shares(recording.area[:, :, k], recording.scene.rig)
            visited = ",".join(str(area) for area in range(1, 11) if shares[area] >= LEAST_TOUCH_PCT)
            summary[f"{side}_areas"] = (visited or "none") if count else ""
    return summary
