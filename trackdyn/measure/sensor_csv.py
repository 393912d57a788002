"""CSV files of the acceleration sensor: time in s and three axes in g, one row a sample.

A file is UTF-8 text: comment lines that begin with ``#``, the header ``t_s,ax_g,ay_g,az_g``, then
numbers with decimal points. Reading refuses what is doubtful instead of repairing it, because a gap or
a wrong rate would quietly move every frequency derived from the record.
"""

import csv
import difflib
import io
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.replacing import replacing

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g")
HEADER = ",".join(COLUMNS)
_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class SensorRecord:
    """One record of the sensor (Eq. 40), N samples.

    Attributes
    ----------
    path : Path
        File it was read from.
    t_s : (N,) array
        Time, s.
    ax_g, ay_g, az_g : (N,) arrays
        Specific force in the sensor's axes, g.
    rate_hz : float
        Sampling rate, Hz.
    clipped : int
        Number of rows with an axis at the end of the sensor's range.
    """

    path: Path
    t_s: np.ndarray
    ax_g: np.ndarray
    ay_g: np.ndarray
    az_g: np.ndarray
    rate_hz: float
    clipped: int


def read_sensor_csv(path, rate_hz: float = 1000.0, range_g: float = 20.0) -> SensorRecord:
    """Read a sensor file and check every value of it.

    Parameters
    ----------
    path : path-like
        File.
    rate_hz : float
        Sampling rate the file must have, Hz.
    range_g : float
        Range of the sensor, g; values beyond it cannot be measurements.

    Returns
    -------
    SensorRecord

    Raises
    ------
    InputError
        Any defect of the file; the sentence names the file, the field and line, the value and the remedy.
    """
    path = Path(path)
    for name, value in (("rate_hz", rate_hz), ("range_g", range_g)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{path}: {name} is {value!r}; give a finite number above zero.")
    text = _read_text(path)
    header_line, body = _split_header(path, text)
    table = _parse_fast(body)
    if table is None:
        table = _parse_by_line(path, body, header_line + 1)
    if len(table) < 2:
        raise InputError(f"{path}: the file holds {len(table)} data rows below '{HEADER}'; give at least 2.")
    _check_time(path, table[:, 0], float(rate_hz), header_line + 1)
    magnitude = np.abs(table[:, 1:])
    _check_range(path, table, magnitude, float(range_g), header_line + 1)
    clipped = int(np.count_nonzero(np.max(magnitude, axis=1) >= range_g * (1.0 - 1e-6)))
    t_s, ax_g, ay_g, az_g = np.ascontiguousarray(table.T)
    return SensorRecord(path, t_s, ax_g, ay_g, az_g, float(rate_hz), clipped)


def write_sensor_csv(path, t_s, ax, ay, az, comments: Iterable[str] = ()) -> None:
    """Write a sensor file; equal input gives equal bytes, and a broken run leaves no half file.

    Parameters
    ----------
    path : path-like
        File, replaced if it exists.
    t_s : (N,) array
        Time, s, strictly increasing: written with 3 decimals, or with up to 9 where the samples do
        not lie on whole milliseconds.
    ax, ay, az : (N,) arrays
        Specific force, g, written with 4 decimals.
    comments : iterable of str
        Lines written above the header, each behind ``# ``.

    Raises
    ------
    InputError
        Arrays of unequal length, fewer than 2 samples, values that are not finite, or a folder that
        cannot be written.
    """
    path = Path(path)
    columns = [np.asarray(values, dtype=float) for values in (t_s, ax, ay, az)]
    for name, values in zip(COLUMNS, columns, strict=True):
        if values.ndim != 1 or values.size != columns[0].size or values.size < 2:
            raise InputError(
                f"{path}: {name} has the shape {values.shape}; give four one-dimensional arrays of the "
                "same length with at least 2 samples."
            )
        if not np.all(np.isfinite(values)):
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"{path}: {name} is {values[k]} in sample {k}; give finite values only.")
    if np.any(np.diff(columns[0]) <= 0.0):
        k = int(np.flatnonzero(np.diff(columns[0]) <= 0.0)[0]) + 1
        raise InputError(f"{path}: t_s does not increase in sample {k}; sort the samples by time.")

    lines = [f"# {line}".rstrip() for comment in comments for line in str(comment).splitlines() or [""]]
    lines.append(HEADER)
    row = f"%.{_time_decimals(columns[0])}f,%.4f,%.4f,%.4f"
    lines.extend(row % values for values in zip(*(c.tolist() for c in columns), strict=True))
    data = ("\n".join(lines) + "\n").encode("utf-8")

    try:
        with replacing(path) as part:
            part.write_bytes(data)
    except OSError as error:
        reason = error.strerror or "unknown reason"
        raise InputError(f"{path}: the file cannot be written ({reason}); choose another place.") from error


def _time_decimals(t_s):
    """Fewest decimals, 3 to 9, that give every time to a nanosecond."""
    for decimals in range(3, 9):
        if np.max(np.abs(t_s - np.round(t_s, decimals))) <= 1e-9:
            return decimals
    return 9


def _read_text(path):
    """The whole file as text with plain newlines."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: the file does not exist; check the path.") from None
    except IsADirectoryError:
        raise InputError(f"{path}: this is a folder, not a file; give one CSV file in it.") from None
    except OSError as error:
        reason = error.strerror or "unknown reason"
        raise InputError(f"{path}: the file cannot be read ({reason}); check its permissions.") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{path}: byte 0x{data[error.start]:02x} in line {line} is not UTF-8; save the file as UTF-8 text."
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _split_header(path, text):
    """Line number of the header (from 1) and the text below it."""
    number, position = 0, 0
    while position < len(text):
        end = text.find("\n", position)
        end = len(text) if end < 0 else end
        line = text[position:end]
        number, position = number + 1, end + 1
        if line.strip() and not line.startswith("#"):
            _check_header(path, line, number, text[position:])
            return number, text[position:]
    what = "empty" if not text.strip() else "without a header"
    raise InputError(f"{path}: the file is {what}; it must hold the header '{HEADER}' and at least 2 rows.")


def _check_header(path, line, number, body):
    """Refuse every header but the exact one, saying what is wrong with it."""
    if line == HEADER:
        return
    for separator, name in _SEPARATORS.items():
        if separator in line:
            decimal = " and decimal commas" if "," in body.partition("\n")[0] else ""
            remedy = "commas as separators and decimal points" if decimal else "commas"
            raise InputError(
                f"{path}: the header in line {number} has {name}{decimal} where '{HEADER}' was expected; "
                f"save the file with {remedy}."
            )
    found = line.split(",")
    if all(_NUMBER.fullmatch(name.strip()) for name in found):
        raise InputError(
            f"{path}: line {number} holds numbers ({_show(line)}) where the header must be; put '{HEADER}' above them."
        )
    missing = [name for name in COLUMNS if name not in found]
    extra = [name for name in found if name not in COLUMNS]
    for name in extra:
        near = difflib.get_close_matches(name.strip().lower(), missing, n=1, cutoff=0.5)
        if near:
            raise InputError(f"{path}: column {_show(name)} in line {number} is misspelt; rename it to '{near[0]}'.")
    if missing:
        raise InputError(
            f"{path}: column '{missing[0]}' is missing in line {number} ({_show(line)}); the header must be '{HEADER}'."
        )
    if extra:
        raise InputError(f"{path}: column {_show(extra[0])} in line {number} is not one of '{HEADER}'; remove it.")
    raise InputError(
        f"{path}: the columns in line {number} ({_show(line)}) are repeated or out of order; "
        f"arrange them as '{HEADER}'."
    )


def _parse_fast(body):
    """(N, 4) array of a clean body, or None for whatever needs a closer look."""
    data = body.encode("utf-8")
    if not data.endswith(b"\n"):
        data += b"\n"
    rows = data.count(b"\n")
    try:
        table = pd.read_csv(io.BytesIO(data), header=None, dtype=np.float64, quoting=csv.QUOTE_NONE).to_numpy()
    except (ValueError, pd.errors.ParserError):
        return None
    # Pandas fills short rows with NaN, drops empty ones and takes the number of columns from the first row.
    return table if table.shape == (rows, 4) and np.all(np.isfinite(table)) else None


def _parse_by_line(path, body, first_line):
    """(N, 4) array of the body, or the sentence for its first defect."""
    lines = body.rstrip("\n").split("\n") if body.strip() else []
    table = np.empty((len(lines), 4))
    for k, line in enumerate(lines):
        fields = line.split(",")
        if len(fields) != 4:
            _refuse_row(path, line, fields, first_line + k, last=k == len(lines) - 1)
        for column, (name, field) in enumerate(zip(COLUMNS, fields, strict=True)):
            where = f"{path}: field {name} in line {first_line + k}"
            value = field.strip()
            if not value:
                raise InputError(f"{where} is empty ({_show(line)}); supply the number.")
            if _NOT_FINITE.fullmatch(value):
                raise InputError(f"{where} is {_show(value)}, not a finite number; record the sample again.")
            if not _NUMBER.fullmatch(value):
                raise InputError(f"{where} is {_show(value)}, not a number; write it with a decimal point.")
            table[k, column] = float(value)
            if not np.isfinite(table[k, column]):
                raise InputError(f"{where} is {_show(value)}, too large for a number; correct it.")
    return table


def _refuse_row(path, line, fields, number, last):
    """Say why a row has not got four fields."""
    where = f"{path}: line {number} ({_show(line)})"
    if not line.strip():
        raise InputError(f"{where} is empty where the field t_s must begin; remove the line.")
    for separator, name in _SEPARATORS.items():
        if separator in line:
            decimal = " and decimal commas" if "," in line else ""
            raise InputError(
                f"{where} has {name}{decimal} between the fields {HEADER}; separate them by commas and "
                "write decimal points."
            )
    if len(fields) > 4:
        hint = "these look like decimal commas; write decimal points" if len(fields) == 8 else "remove the rest"
        raise InputError(f"{where} has {len(fields)} fields, more than the 4 of {HEADER}; {hint}.")
    what = "the last line is truncated" if last else "the line is incomplete"
    raise InputError(
        f"{where} has {len(fields)} of 4 fields and ends before {COLUMNS[len(fields)]}, {what}; complete or remove it."
    )


def _check_time(path, t_s, rate_hz, first_line):
    """Refuse time that falls, runs at another rate, or has gaps."""
    step = np.diff(t_s)
    fall = np.flatnonzero(step <= 0.0)
    if fall.size:
        k = int(fall[0]) + 1
        raise InputError(
            f"{path}: field t_s in line {first_line + k} is {t_s[k]:.9g} s after {t_s[k - 1]:.9g} s, time must "
            "increase; sort the rows or remove the repeated ones."
        )
    _check_rate(path, 1.0 / np.median(step), rate_hz, first_line)
    mean = (t_s.size - 1) / (t_s[-1] - t_s[0])
    uneven = np.flatnonzero(np.abs(step * rate_hz - 1.0) > 0.5)
    if uneven.size:
        k = int(uneven[0]) + 1
        what = "a gap" if step[k - 1] * rate_hz > 1.0 else "a step too short"
        raise InputError(
            f"{path}: field t_s in line {first_line + k} has {what}, from {t_s[k - 1]:.9g} to {t_s[k]:.9g} s "
            f"(the rows average {mean:.6g} Hz, {rate_hz:.6g} Hz is required); record again or cut the file there."
        )
    # Small uneven steps can hide a wrong mean rate behind a right median.
    _check_rate(path, mean, rate_hz, first_line)


def _check_rate(path, found, rate_hz, first_line):
    """Refuse a rate that is off by more than 0.1 %, far below the resolution of a 90 s spectrum."""
    if abs(found / rate_hz - 1.0) > 1e-3:
        raise InputError(
            f"{path}: field t_s runs at {found:.6g} Hz from line {first_line} on, but {rate_hz:.6g} Hz is "
            f"required; resample the record or ask for rate_hz={found:.6g}."
        )


def _check_range(path, table, magnitude, range_g, first_line):
    """Refuse values that the sensor cannot give."""
    beyond = np.argwhere(magnitude > range_g * 1.0001)
    if len(beyond):
        k, axis = beyond[0]
        raise InputError(
            f"{path}: field {COLUMNS[axis + 1]} in line {first_line + k} is {table[k, axis + 1]:.6g}, beyond the "
            f"sensor's range of +-{range_g:g} g; check the unit (g, not m/s2) or give the range of the sensor."
        )


def _show(value):
    """A value of the file as it may stand in a sentence: quoted, on one line, not too long."""
    value = value if len(value) <= 40 else value[:37] + "..."
    return repr(value)
