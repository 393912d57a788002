"""Records of loggers: a whole text, or the channels of one group of a file in a format of its own (`formats`).

What has no format of its own is text (`trackdyn.sensor.logger_text`). Channels are read when they are chosen.
"""

import gc
import gzip
import logging
import re
import sys
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from trackdyn.errors import InputError, shown
from trackdyn.extras import required
from trackdyn.files import plain_file
from trackdyn.sensor.formats import BITS, FORMATS, MOST_BYTES, WIDE, Format, Item, decoded
from trackdyn.sensor.logger_text import Source
from trackdyn.sensor.sensor_mapping import NAME_IT
from trackdyn.sensor.stamps import DATE, RATES, Rate

MOST_NUMBERS = MOST_BYTES // 8  # in the channels of a record
# names, without signs between their letters, of the samples a second and of the time between two of them
_RATE = re.compile(r"(fs|sr|sps|samp(l(es?|ing))?(rate|freq(uency)?)|samples?per(s|sec|second))(in)?(hz)?")
_INTERVAL = re.compile(r"(samp(l(es?|ing))?(interval|period|time|step)|wfincrement)(in)?(s|sec|seconds)?")
# names of numbers that may be meant for them
_RATE_LIKE = re.compile(r"rate|freq|hz|fs|sr|sps|samp|interval|period|increment|step|delta|dt|ts")
# how files begin that are no text and are not read
_OTHERS = {
    b"0       ": "EDF", b"\xffBIOSEMI": "BDF", b"SQLite format 3": "a SQLite database",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet",
}  # fmt: skip
_CONTROL = bytes(byte for byte in range(32) if byte not in b"\t\n\v\f\r\x1a")
_STAMPED = re.compile(
    rf"^[ \t]*(?:\[(?P<boxed>{DATE.pattern})\]|(?P<stamp>{DATE.pattern}) ->)[ \t]*(?P<rest>.*)$",
    re.ASCII | re.MULTILINE,
)
_FORTRAN = re.compile(r"(?<![\w.])([+-]?\d{1,20}\.\d{0,20})[dD]([+-]?\d{1,3})(?!\w)", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class Channels(Source):
    """Channels of one group that have as many samples, in their order in the file."""

    group: str  # its name in the file; empty if the file has none
    items: Sequence[Item]
    bits: int | None  # in a sample, where the file states them
    read: Callable[[Callable], Any]  # calls what reads from the file (`_by_library`)

    def _samples(self, column: int) -> np.ndarray:
        """(N,) samples of a channel; instants and durations in s, since the first one."""
        values = np.asarray(self.read(self.items[column].load))
        if values.dtype.kind in "mM":
            return (values - (values[0] if values.dtype.kind == "M" else 0)) / np.timedelta64(1, "s")
        return values.astype(float)

    def _numbers(self, columns, time, gaps, day_first) -> np.ndarray:
        if (numbers := self.items[0].size * len(columns)) > MOST_NUMBERS:
            raise InputError(
                f"{self.path}: the channels hold {numbers / 1e6:.0f} million numbers; give a part of it, at most "
                f"{MOST_NUMBERS / 1e6:.0f} million are read."
            )
        table = np.column_stack([self._samples(column) for column in columns])
        wrong = ~np.isfinite(table)
        if gaps:
            table[wrong] = np.nan
        elif wrong.any():
            row, index = np.argwhere(wrong)[0]
            name = self.names[columns[index]]
            raise InputError(
                f"{self.path}: channel {name!r} is {table[row, index]} in sample {row + 1}; give a record without "
                "gaps, or --gaps bridge or --gaps longest."
            )
        return table


def read_logger_text(path: Path) -> str:
    """A whole text file of at most ``MOST_BYTES``, with plain newlines.

    UTF-8, UTF-16 with its mark, Shift-JIS or Latin-1: numbers are the same in all of them, names and units may not be.
    A file packed by gzip is unpacked; comments stand behind ``#``, exponents behind ``e``, whatever the file has. The
    time that a serial monitor sets before every line becomes the last field of the line. Raises `InputError`: the file
    cannot be read, is larger, or holds no text.
    """
    plain_file(path, "CSV file")
    try:
        with path.open("rb") as file, gzip.GzipFile(fileobj=file) as unpacked:
            packed = file.read(2) == b"\x1f\x8b"
            file.seek(0)
            data = (unpacked if packed else file).read(MOST_BYTES + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"{path}: the gzip file is damaged ({error}); pack it again.") from None
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check its permissions.") from None
    if data.startswith(b"PK"):
        kind = "a recording" if data[30:38] == b"meta.npy" else "an archive or a spreadsheet"
        raise InputError(f"{path}: this is {kind}, not a sensor's file; give a CSV file.")
    if len(data) - len(data.translate(None, _CONTROL)) > 0.02 * len(data) and not data.startswith(WIDE):
        kind = next((kind for begin, kind in _OTHERS.items() if data.startswith(begin)), "binary data")
        read = ", ".join(form.name for form in FORMATS)
        raise InputError(f"{path}: this is {kind}, not text and none of {read}; export it as CSV.")
    if len(data) > MOST_BYTES:
        raise InputError(f"{path}: the file holds more than {MOST_BYTES / 1e6:.0f} MB; give a part of it.")
    text = decoded(data)
    head = text.split("\n", 200)[:200]
    if any(map(_FORTRAN.search, head)):
        text = _FORTRAN.sub(r"\1e\2", text)
    stamped = [line["rest"] for line in map(_STAMPED.match, head) if line]
    if len(stamped) > len(head) / 2:
        sign = next((sign for sign in "\t;, " if sign in stamped[-1]), ",")
        text = _STAMPED.sub(lambda line: f"{line['rest']}{sign}{line['boxed'] or line['stamp']}", text)
    # rows of files that have their comments behind another sign do not hold it
    mark = next((mark for mark in (";", "%", "//") if text.startswith(mark)), None)
    if mark is None or any(mark in line for line in head if not line.lstrip().startswith(mark)):
        return text
    return re.sub(rf"^[ \t]*{mark}", "#", text, flags=re.MULTILINE)


def read_channels(
    path: Path, kind: Format, ay_of: Callable[[Sequence[str], str], str], sought: str, opened: ExitStack
) -> Channels:
    """The one group of a file that has a column for ay, read while ``opened`` is.

    ``ay_of`` gives the name of that column among those of a group, or an empty text; ``sought`` names it in a refusal.
    Raises `InputError`: no file of this format or a damaged one, no such group or several, or a package is not
    installed.
    """
    plain_file(path, "record")
    required(kind.package)
    remarks: list[str] = []
    read = partial(_by_library, path, kind, remarks)
    named = read(lambda: kind.read(path, opened))
    groups = read(
        lambda: [group for name, items in named.items() for group in _groups(path, name, items, read, remarks)]
    )
    usable = [group for group in groups if ay_of(group.names, group.group)]
    names = [name for group in groups for name in group.names]
    if not usable:
        listed = ", ".join(map(shown, names[:20]))
        remedy = NAME_IT if names else "export the record as CSV"
        raise InputError(f"{path}: no {sought}; there are {listed or 'no channels'}; {remedy}.")
    if len(usable) > 1:
        ways = [f"'{group.group}/{ay_of(group.names, group.group)}'" for group in usable if group.group]
        how = f"with its group, --axis ay={ways[-1]}" if ways else f"--axis ay={usable[0].names[0]!r}"
        raise InputError(
            f"{path}: {len(usable)} groups of channels have a {sought} ({', '.join(ways) or 'of other lengths'}); name "
            f"the channel {how}."
        )
    return usable[0]


@contextmanager
def _collected(package: str, remarks: list[str]) -> Iterator[None]:
    """Collect what a library warns of and logs, which would stand on the screen else."""

    def collect(record: logging.LogRecord) -> bool:
        if record.levelno >= logging.WARNING:
            remarks.append(" ".join(record.getMessage().split()))
        return False

    named = logging.root.manager.loggerDict.items()
    loggers = [log for name, log in named if name.partition(".")[0] == package and isinstance(log, logging.Logger)]
    for log in loggers:
        log.addFilter(collect)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", UserWarning)
            yield
        remarks += [" ".join(str(warning.message).split()) for warning in caught]
    finally:
        for log in loggers:
            log.removeFilter(collect)


def _by_library(path: Path, kind: Format, remarks: list[str], call: Callable) -> Any:
    """Call ``call``; warnings go to ``remarks``, and a failure is one sentence (`InputError`)."""
    failure = ""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None  # half-made objects complain when they are collected
    try:
        with _collected(kind.package, remarks):
            result = call()
    except InputError:
        raise
    except MemoryError:
        failure = "asks for more memory than there is; export a part of the record"
    except Exception as error:  # a library raises whatever a damaged file brings about
        reason = str(error) if type(error) is ValueError and len(str(error)) < 20 else type(error).__name__
        failure = f"is no {kind.name} file or a damaged one ({reason}); export the record again"
    finally:
        if failure:
            gc.collect()
        sys.unraisablehook = hook
    if failure:
        raise InputError(f"{path}: {failure}.")
    return result


def _rate_of(name: str, number: float) -> float | None:
    """Samples a second that a number states by its name, Hz, if they may be those of a record."""
    key = re.sub(r"[^a-z]", "", name.casefold())
    hz = number if _RATE.fullmatch(key) else 1 / number if _INTERVAL.fullmatch(key) and number else 0.0
    return hz if RATES[0] <= hz <= RATES[1] else None


def _groups(path, name: str, items: Iterable[Item], read, remarks) -> Iterator[Channels]:
    """Channels of the same number of samples.

    The rate of a channel is that number beside it, or else beside its group, whose name speaks of samples.
    """
    channels: dict[int, list[Item]] = {}
    numbers: dict[tuple[str, ...], float] = {}
    for item in items:
        if item.size > 1:
            channels.setdefault(item.size, []).append(item)
        else:
            numbers[item.at] = float(np.asarray(item.load()).ravel()[0])

    def rate(at: tuple[str, ...]) -> Rate | None:
        for level in range(len(at), -1, -1):
            stated = {
                hz: f"as the file states ({'/'.join(where)})"
                for where, number in numbers.items()
                if where[:-1] == at[:level] and (hz := _rate_of(where[-1], number))
            }
            if stated:
                return Rate(*next(iter(stated.items()))) if len(stated) == 1 else None
        return None

    bits = int(numbers.pop((BITS,), 0)) or None
    doubtful = tuple(
        f"{'/'.join(at)} = {number:g}"
        for at, number in numbers.items()
        if _RATE_LIKE.search(at[-1].casefold()) and number > 0
    )
    for of_a_length in channels.values():
        names = [item.name for item in of_a_length]
        names = ["/".join(item.at) if names.count(item.name) > 1 else item.name for item in of_a_length]
        units = [item.unit for item in of_a_length]
        rates = {k: stated for k, item in enumerate(of_a_length) if (stated := rate(item.at))}
        yield Channels(
            path=path, group=name, names=names, units=units, items=of_a_length, rates=rates, doubtful=doubtful,
            bits=bits, read=read, remarks=remarks,
        )  # fmt: skip
