"""Catalogue of measures: columns of a run and their estimators; all other modules read it."""

# no numerical library: commands list measures in their help
import re
from collections.abc import Callable
from math import nan
from typing import Any, Literal, NamedTuple


class Column(NamedTuple):
    """Column of a run (`metrics.run_metrics`)."""

    name: str
    error: str  # column of the standard error, or the reason why there is none
    unit: str
    text: str  # description; empty: only a row of a comparison
    # reference of its tolerances and errors: the value, a turn of the sprocket, none
    kind: Literal["relative", "turns", "phase", "absolute"] = "relative"
    shown: bool = False  # printed with a run

    @property
    def has_error(self) -> bool:
        """True if it has a standard error."""
        return " " not in self.error

    def size(self, value: float) -> float:
        """Return the reference of an error: the value, or 1 for a share of a turn or a phase."""
        return 1.0 if self.kind in ("turns", "phase") else abs(value)


class Passages(NamedTuple):
    """Mean over the passages of a side (`estimators.contact_series`) of ``values``, a column of these, or its root."""

    values: str
    root: bool = False


class Studied(NamedTuple):
    """Measure of tolerances and studies."""

    name: str
    words: str  # heading
    # from every link as a sensor (`whole_loop.Links`): a `Series`, or None without values; no tolerance if None
    series: Callable[[Any], Any] | None = None
    short: str = ""  # heading of its error, in a narrow table


class Measure(NamedTuple):
    """A column and its estimator."""

    column: Column
    # value and standard error of an `estimators.Sensed`, or `Passages`; None: computed by `metrics.run_metrics`
    estimator: Any = None
    studied: Studied | None = None


def _entry(name: str, unit: str, text: str, estimator, studied=None, **column: Any) -> Measure:
    """Return a measure with other fields of its ``column``; the ``error`` of ``line_hz`` is ``line_error_hz``."""
    error, count = re.subn(r"_(g|hz|pct|n)(?=_|$)", r"_error_\1", name)
    fields = {"error": error if count else f"{name}_error"} | column
    return Measure(Column(name, unit=unit, text=text, **fields), estimator, studied)


# measures of a y acceleration; those that are shown, or have no text, are also compared with a sensor's
ACCELERATION = (
    _entry("mean_g", "g", "", lambda s: s.of(s.mean)),
    _entry("rms_g", "g", "root mean square of the sensor's y acceleration (Eq. 40) over whole revolutions of the loop",
           lambda s: s.of(s.rms),
           Studied("rms", "RMS of the acceleration", lambda s: s.series(s.ay**2, root=True), "RMS, %"), shown=True),
    _entry("sd_g", "g", "standard deviation of the sensor's y acceleration over whole revolutions of the loop",
           lambda s: s.of(s.sd), Studied("sd", "SD of the acceleration", lambda s: s.sd()), shown=True),
    _entry("line_hz", "Hz", "frequency of the dominant peak, the highest bin of the FFT",
           lambda s: (s.bin[0], s.line_errors.bin_hz)),
    _entry("line_g", "g", "amplitude of the dominant peak, the highest bin of the FFT",
           lambda s: (s.bin[1], s.line_errors.bin_amplitude)),
    _entry("line_hz_binfree", "Hz", "frequency of the dominant peak, interpolated between bins",
           lambda s: (s.line[0], s.line_errors.hz), shown=True),
    _entry("line_g_binfree", "g", "amplitude of the dominant peak, interpolated between bins",
           lambda s: (s.line[1], s.line_errors.amplitude),
           Studied("line", "amplitude of the dominant peak", lambda s: s.line()), shown=True),
    _entry("high_frequency_g", "g",
           "root mean square of the content at and above 20 Hz, over whole revolutions of the loop",
           lambda s: s.high_frequency(),
           Studied("high_frequency", "RMS of the acceleration at and above 20 Hz",
                   lambda s: s.series(s.high_passed(s.ay) ** 2, root=True), "above 20 Hz, %"), shown=True),
)  # fmt: skip


def _of(side: str, heading: str, sentence: str) -> tuple[Measure, ...]:
    """Return the measures of a side of the sprocket, by their values in passages (`estimators.meshing_summary`)."""
    force, run = f"normal force on {sentence}", "over the run"
    share = Studied(f"{side}_share", f"contact duration, {heading}", lambda s: s.share(side), f"{side} contact, points")
    peak = Studied(f"{side}_peak", f"mean peak force, {heading}", lambda s: s.peaks(side), f"{side} peak, %")
    return (
        _entry(f"{side}_share_pct", "%", f"contact duration of {sentence}, % of a sprocket turn, mean over passages",
               Passages("share_pct"), share, kind="turns", shown=True),
        _entry(f"{side}_rms_n", "N", f"root mean square of the {force} {run}", Passages("square_n2", root=True)),
        _entry(f"{side}_sd_n", "N", f"standard deviation of the {force} {run}", Passages("variance_n2", root=True)),
        _entry(f"{side}_rms_contact_n", "N", f"root mean square of the {force} over the time in contact",
               Passages("square_in_contact_n2", root=True)),
        _entry(f"{side}_peak_n", "N", f"largest {force} in a passage, mean over passages", Passages("peak_n"),
               peak if side != "ring" else None, shown=True),
        _entry(f"{side}_peak_largest_n", "N", f"largest {force} in all passages", Passages("peak_n"),
               error="the largest of a sample, which grows with the record; compare peak_n"),
        *(_entry(f"{side}_phase_{end}", "turns", f"{event} of {sentence} after the first contact of the passage, mean",
                 Passages(f"phase_{end}"), kind="phase")
          for end, event in (("start", "first touch"), ("end", "last release"))),
    )  # fmt: skip


# sides as in `model.arrays`, in a heading and in a sentence
OF_SIDES = {side: _of(side, f"{side} arc", f"the {side} arc") for side in ("left", "right")}
OF_SIDES["ring"] = _of("ring", "ring", "a link on the ring")
OTHERS = (
    *(Measure(Column(f"{surface}_sliding_j", f"{surface}_sliding_error_j", "J",
                     f"friction work on the {surface}, force times slip of all contacts, in a sprocket turn",
                     shown=True)) for surface in ("teeth", "ring")),
    Measure(Column("motor_power_w", "motor_power_error_w", "W", "mean power of the motor at the sprocket", shown=True)),
    Measure(Column("loop_gap_max_m", "the largest value of a check over the record, no estimate of a mean", "m",
                   "largest distance of the two ends of the loop after projection", "absolute"),
            studied=Studied("loop_gap", "largest closure error")),
    Measure(Column("energy_residual", "the residual of this record, no estimate of a mean", "1",
                   "residual of the energy balance, relative to the work of the sprocket", "absolute"),
            studied=Studied("energy_residual", "residual of the energy balance")),
)  # fmt: skip
CATALOGUE = (*ACCELERATION, *(measure for sides in zip(*OF_SIDES.values(), strict=True) for measure in sides), *OTHERS)
SCALES = {"turns": 100.0, "absolute": 1.0}  # references of tolerances by kind; of others the value
BY_COLUMN = {measure.column.name: measure for measure in CATALOGUE}
NAMED = {measure.studied.name: measure for measure in CATALOGUE if measure.studied}
SERIES = {measure.studied.name: measure.studied.series for measure in CATALOGUE if measure.studied}
RELATIVE, SHARES, ABSOLUTE = (
    tuple(name for name, measure in NAMED.items() if measure.column.kind == kind)
    for kind in ("relative", "turns", "absolute")
)
# measures that can have a tolerance: those of every link
TOLERATED = tuple(name for name in RELATIVE + SHARES if SERIES[name])
SENSED = tuple(name for name in TOLERATED if NAMED[name] in ACCELERATION)


def scale_of(name: str, value: float) -> float:
    """Return the reference of a tolerance: a turn of the sprocket (shares are in %), or a size; NaN for 0."""
    return SCALES.get(NAMED[name].column.kind) or abs(value) or nan
