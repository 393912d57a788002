"""Catalogue of measures: columns, unit, description, kind and estimators of each; all other modules read it."""

# no numerical library: commands list measures in their help
from math import nan
from typing import Any, Literal, NamedTuple


class Measure(NamedTuple):
    """A column of a run; one with a name is a measure of tolerances and studies, too."""

    column: str  # of `metrics.run_metrics`
    error: str  # column of the standard error, or the reason why there is none
    unit: str
    text: str  # description; empty: only a row of a comparison
    # reference of its tolerances and errors: the value, a turn of the sprocket, none
    kind: Literal["relative", "turns", "phase", "absolute"] = "relative"
    name: str = ""
    words: str = ""  # of the name, as a heading
    short: str = ""  # of its error, in a narrow table
    # estimators, or None
    sensed: Any = None  # from a sensor's record (`estimators.Sensed`): value and standard error
    series: Any = None  # from every link as a sensor (`whole_loop.Links`): a `Series`, or None without values
    # from rows of a side (`estimators.contact_series`): values whose mean it is, or maximum without a standard error
    visits: Any = None
    root: bool = False  # it is the root of this mean
    shown: bool = False  # printed with a run
    compared: bool = False  # with a sensor's record

    @property
    def has_error(self) -> bool:
        """True if it has a standard error."""
        return " " not in self.error

    def size(self, value: float) -> float:
        """Return the reference of an error: the value, or 1 for a share of a turn or a phase."""
        return 1.0 if self.kind in ("turns", "phase") else abs(value)

    @property
    def text_unit(self) -> str:
        """Unit of its value in a sentence."""
        return "% of a turn" if self.kind == "turns" else self.unit.removeprefix("1")


ACCELERATION = (
    Measure("mean_g", "mean_error_g", "g", "", compared=True, sensed=lambda s: s.of(s.mean)),
    Measure("rms_g", "rms_error_g", "g",
            "root mean square of the sensor's y acceleration (Eq. 40) over whole revolutions of the loop",
            name="rms", words="RMS of the acceleration", short="RMS, %", shown=True, compared=True,
            sensed=lambda s: s.of(s.rms), series=lambda s: s.series(s.ay**2, root=True)),
    Measure("sd_g", "sd_error_g", "g",
            "standard deviation of the sensor's y acceleration over whole revolutions of the loop",
            name="sd", words="SD of the acceleration", shown=True, compared=True,
            sensed=lambda s: s.of(s.sd), series=lambda s: s.sd()),
    Measure("line_hz", "line_error_hz", "Hz", "frequency of the dominant peak, the highest bin of the FFT",
            sensed=lambda s: (s.bin[0], s.line_errors.bin_hz)),
    Measure("line_g", "line_error_g", "g", "amplitude of the dominant peak, the highest bin of the FFT",
            sensed=lambda s: (s.bin[1], s.line_errors.bin_amplitude)),
    Measure("line_hz_binfree", "line_error_hz_binfree", "Hz",
            "frequency of the dominant peak, interpolated between bins",
            sensed=lambda s: (s.line[0], s.line_errors.hz), shown=True, compared=True),
    Measure("line_g_binfree", "line_error_g_binfree", "g", "amplitude of the dominant peak, interpolated between bins",
            name="line", words="amplitude of the dominant peak", shown=True, compared=True,
            sensed=lambda s: (s.line[1], s.line_errors.amplitude), series=lambda s: s.line()),
    Measure("high_frequency_g", "high_frequency_error_g", "g",
            "root mean square of the content at and above 20 Hz, over whole revolutions of the loop",
            name="high_frequency", words="RMS of the acceleration at and above 20 Hz", short="above 20 Hz, %",
            shown=True, compared=True, sensed=lambda s: s.high_frequency(),
            series=lambda s: s.series(s.high_passed(s.ay) ** 2, root=True)),
)  # fmt: skip


def _of(side: str, heading: str, sentence: str) -> tuple[Measure, ...]:
    """Return the measures of a side of the sprocket, by their values in passages (`estimators.meshing_summary`)."""
    return (
        Measure(f"{side}_share_pct", f"{side}_share_error_pct", "%",
                f"contact duration of {sentence}, % of a sprocket turn, mean over passages", "turns",
                f"{side}_share", f"contact duration, {heading}", f"{side} contact, points", shown=True,
                series=lambda s: s.share(side), visits=lambda rows: rows["share_pct"]),
        Measure(f"{side}_rms_n", f"{side}_rms_error_n", "N",
                f"root mean square of the normal force on {sentence} over the run",
                visits=lambda rows: rows["square_n2"], root=True),
        Measure(f"{side}_sd_n", f"{side}_sd_error_n", "N",
                f"standard deviation of the normal force on {sentence} over the run",
                visits=lambda rows: rows["variance_n2"], root=True),
        Measure(f"{side}_rms_contact_n", f"{side}_rms_contact_error_n", "N",
                f"root mean square of the normal force on {sentence} over the time in contact",
                visits=lambda rows: rows["square_in_contact_n2"], root=True),
        Measure(f"{side}_peak_n", f"{side}_peak_error_n", "N",
                f"largest normal force on {sentence} in a passage, mean over passages",
                "relative", "" if side == "ring" else f"{side}_peak", f"mean peak force, {heading}",
                f"{side} peak, %", shown=True, series=lambda s: s.peaks(side), visits=lambda rows: rows["peak_n"]),
        Measure(f"{side}_peak_largest_n", "the largest of a sample, which grows with the record; compare peak_n", "N",
                f"largest normal force on {sentence} in all passages", visits=lambda rows: rows["peak_n"]),
        Measure(f"{side}_phase_start", f"{side}_phase_start_error", "turns",
                f"first touch of {sentence} after the first contact of the passage, mean", "phase",
                visits=lambda rows: rows["phase_start"]),
        Measure(f"{side}_phase_end", f"{side}_phase_end_error", "turns",
                f"last release of {sentence} after the first contact of the passage, mean", "phase",
                visits=lambda rows: rows["phase_end"]),
    )  # fmt: skip


# sides as in `model.arrays`, in a heading and in a sentence
OF_SIDES = {side: _of(side, f"{side} arc", f"the {side} arc") for side in ("left", "right")}
OF_SIDES["ring"] = _of("ring", "ring", "a link on the ring")
OTHERS = (
    *(Measure(f"{surface}_sliding_j", f"{surface}_sliding_error_j", "J",
              f"friction work on the {surface}, force times slip of all contacts, in a sprocket turn",
              shown=True) for surface in ("teeth", "ring")),
    Measure("motor_power_w", "motor_power_error_w", "W", "mean power of the motor at the sprocket", shown=True),
    Measure("loop_gap_max_m", "the largest value of a check over the record, no estimate of a mean", "m",
            "largest distance of the two ends of the loop after projection", kind="absolute",
            name="loop_gap", words="largest closure error"),
    Measure("energy_residual", "the residual of this record, no estimate of a mean", "1",
            "residual of the energy balance, relative to the work of the sprocket", kind="absolute",
            name="energy_residual", words="residual of the energy balance"),
)  # fmt: skip
CATALOGUE = (*ACCELERATION, *(measure for sides in zip(*OF_SIDES.values(), strict=True) for measure in sides), *OTHERS)
SCALES = {"turns": 100.0, "absolute": 1.0}  # references of tolerances by kind; of others the value
BY_COLUMN = {measure.column: measure for measure in CATALOGUE}
NAMED = {measure.name: measure for measure in CATALOGUE if measure.name}
RELATIVE, SHARES, ABSOLUTE = (
    tuple(name for name, measure in NAMED.items() if measure.kind == kind) for kind in ("relative", "turns", "absolute")
)
# measures that can have a tolerance: those of every link
TOLERATED = tuple(name for name in RELATIVE + SHARES if NAMED[name].series)
SENSED = tuple(name for name in TOLERATED if NAMED[name].sensed)  # measures of the acceleration


def scale_of(name: str, value: float) -> float:
    """Return the reference of a tolerance: a turn of the sprocket (shares are in %), or a size; NaN for 0."""
    return SCALES.get(NAMED[name].kind) or abs(value) or nan
