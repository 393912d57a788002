"""Records of loggers in formats of their own, each turned into one table by the library of its format.

A format is recognised by how its files begin, or else by their ending. What has no format of its own is text
(`trackdyn.sensor.logger_text`). Channels are read when they are chosen; how many samples they have is known before.
"""

import gc
import gzip
import re
import sys
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trackdyn.errors import InputError, shown
from trackdyn.extras import required
from trackdyn.files import plain_file
from trackdyn.sensor.logger_text import NUMBER
from trackdyn.sensor.mat_file import read_mat, unpacked_bytes
from trackdyn.sensor.sensor_mapping import NAME_IT
from trackdyn.sensor.stamps import DATE, RATES

# of a file, or of what it unpacks to: an hour of three axes at 1 kHz; the text and its numbers take some ten times that
MOST_BYTES = 128_000_000
MOST_NUMBERS = MOST_BYTES // 4  # in the channels of a record, as many as so much text may hold
MOST_OBJECTS = 2_000  # datasets and groups of an HDF5 file
MOST_NESTED = 20  # groups within groups
_WIDE = (b"\xff\xfe", b"\xfe\xff")  # marks of UTF-16
_HEAD = 600  # bytes by which a format is recognised
_WAV_HEAD = 10_000  # bytes of a WAV file in which its form is stated
# names, without signs between their letters, of the samples a second and of the time between two of them
_RATE = re.compile(r"(fs|sr|sps|samp(l(es?|ing))?(rate|freq(uency)?)|samples?per(s|sec|second))(in)?(hz)?")
_INTERVAL = re.compile(r"(samp(l(es?|ing))?(interval|period|time|step)|wfincrement)(in)?(s|sec|seconds)?")
# of numbers that may be meant for them
_RATE_LIKE = re.compile(r"rate|freq|hz|fs|sr|sps|samp|interval|period|increment|step|delta|dt|ts")
_UNITS = ("unit", "units", "unit_string", "NI_UnitDescription")
_NAMES = ("names", "columns", "column_names", "channels", "channel_names", "labels")
_SCALED = ("scale_factor", "add_offset", "_FillValue")  # what attributes of a dataset say of its numbers
_BITS = ("format", "bits")  # of the samples of a WAV file
_NUMBERS = "iuf"
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


class Item(NamedTuple):
    """A channel of a file, or a number that stands beside channels."""

    name: str
    at: tuple[str, ...]  # where it stands: names of groups from the file down, the last one its own
    unit: str
    size: int  # samples; 1: a number
    load: Callable[[], np.ndarray]  # reads them


class Rate(NamedTuple):
    """Samples a second, Hz, and the name of the number that states them."""

    hz: float
    name: str


class Channels(NamedTuple):
    """Channels of one group that have as many samples."""

    path: Path  # the file
    group: str  # its name in the file; empty if the file has none
    # names, units: of the channels, in their order in the file
    names: list[str]
    units: list[str]
    items: Sequence[Item]
    rates: list[Rate | None]  # that the file states of each channel
    doubtful: tuple[str, ...]  # numbers, with their names, that may or may not be a rate of samples
    bits: int | None  # of a sample, where the file states them
    read: Callable[[Callable], Any]  # calls what reads from the file (`_by_library`)
    remarks: list[str]  # of the library
    first_line: int = 1  # number of the first sample, from 1
    left_out: tuple[str, ...] = ()  # as in `logger_text.Layout`

    def samples(self, column: int) -> np.ndarray:
        """(N,) samples of a channel; instants and durations in s, since the first one."""
        values = np.asarray(self.read(self.items[column].load))
        if values.dtype.kind in "mM":
            return (values - (values[0] if values.dtype.kind == "M" else 0)) / np.timedelta64(1, "s")
        return values.astype(float)

    def rising(self, column: int) -> bool:
        """Whether the samples of a channel never fall, and rise: they may be stamps."""
        step = np.diff(self.samples(column))
        return bool((step >= 0).all() and step.any())

    def table(self, columns: Sequence[int], gaps: bool = False) -> np.ndarray:
        """(N, c) numbers of some channels.

        Raises `InputError`: they are too many, or one is not finite; with ``gaps`` such a one is NaN.
        """
        if (numbers := self.items[0].size * len(columns)) > MOST_NUMBERS:
            raise InputError(
                f"{self.path}: the channels hold {numbers / 1e6:.0f} million numbers; give a part of it, at most "
                f"{MOST_NUMBERS / 1e6:.0f} million are read."
            )
        table = np.column_stack([self.samples(column) for column in columns])
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


class Format(NamedTuple):
    """A format of files: what it is called, what reads it, and how its files begin and end.

    ``read`` opens a file and gives its groups by name.
    """

    name: str
    package: str
    read: Callable[[Path], AbstractContextManager[Mapping[str, Iterable[Item]]]]
    begins: re.Pattern[bytes]
    endings: tuple[str, ...]


def format_of(path: Path) -> Format | None:
    """The format of a file; None for text, for a format that is not read, and for what is no file."""
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD) if path.is_file() else b""
    except (OSError, ValueError):
        head = b""
    matching = [form for form in FORMATS if form.begins.match(head)]
    text = head and not re.search(rb"[\0-\x08\x0e-\x19\x1b-\x1f]", head)
    ending = path.suffix.lower()
    return next(iter(matching), None) or next((form for form in FORMATS if ending in form.endings and not text), None)


def read_logger_text(path: Path) -> str:
    """A whole text file of at most ``MOST_BYTES``, with plain newlines.

    UTF-8, UTF-16 with its mark, Shift-JIS or Latin-1: numbers are the same in all of them, names and units may not be.
    A file packed by gzip is unpacked; comments stand behind ``#``, exponents behind ``e``, whatever the file has. The
    time that a serial monitor sets before every line becomes the last field of the line.
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
    if len(data) - len(data.translate(None, _CONTROL)) > 0.02 * len(data) and not data.startswith(_WIDE):
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


def decoded(data: bytes) -> str:
    """Text of a file with plain newlines."""
    try:
        text = data.decode("utf-16" if data.startswith(_WIDE) else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
        if re.search("[\x80-\x9f]", text[:10_000]):  # no letters of Latin-1, but halves of Japanese ones
            with suppress(UnicodeDecodeError):
                text = data.decode("cp932")
    return text.replace("\r\n", "\n").replace("\r", "\n")


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
    read = partial(_by_library, path, kind.name, remarks)
    named = read(lambda: opened.enter_context(kind.read(path)))
    groups = read(lambda: [one for name, items in named.items() for one in _groups(path, name, items, read, remarks)])
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


def _by_library(path: Path, name: str, remarks: list[str], call: Callable) -> Any:
    """What ``call`` returns; its warnings go to ``remarks``, and a failure is one sentence."""
    failure = ""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None  # half-made objects complain when they are collected
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", UserWarning)
            result = call()
        remarks += [" ".join(str(warning.message).split()) for warning in caught]
    except InputError:
        raise
    except MemoryError:
        failure = "asks for more memory than there is; export a part of the record"
    except Exception as error:  # a library raises whatever a damaged file brings about
        reason = str(error) if type(error) is ValueError and len(str(error)) < 20 else type(error).__name__
        failure = f"is no {name} file or a damaged one ({reason}); export the record again"
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
                hz: "/".join(where)
                for where, number in numbers.items()
                if where[:-1] == at[:level] and (hz := _rate_of(where[-1], number))
            }
            if stated:
                return Rate(*next(iter(stated.items()))) if len(stated) == 1 else None
        return None

    bits = int(numbers.pop(_BITS, 0)) or None
    doubtful = tuple(
        f"{'/'.join(at)} = {number:g}"
        for at, number in numbers.items()
        if _RATE_LIKE.search(at[-1].casefold()) and number > 0
    )
    for of_a_length in channels.values():
        names = [item.name for item in of_a_length]
        names = ["/".join(item.at) if names.count(item.name) > 1 else item.name for item in of_a_length]
        units, rates = [item.unit for item in of_a_length], [rate(item.at) for item in of_a_length]
        yield Channels(path, name, names, units, of_a_length, rates, doubtful, bits, read, remarks)


class _Unread(NamedTuple):
    """An array that is read where it is indexed."""

    dtype: np.dtype
    shape: tuple[int, ...]
    load: Callable[[], np.ndarray]

    def __getitem__(self, index):
        return self.load()[index]


def _items(array, at: Sequence[str], name: str = "", unit: str = "", names: Sequence[str] = ()) -> Iterator[Item]:
    """Channels of an array, or of what has its shape and type and is read where it is indexed.

    A table, (N, c) or (c, N), has a channel a column, ``name 1`` and so on or by ``names``; records have one a field.
    Axes of length one do not count; texts and truth values are no channels.
    """
    at, shape = tuple(at) or ("1",), tuple(array.shape)
    if array.dtype.names:
        for field in array.dtype.names:
            of_field = array.dtype[field]
            unread = _Unread(of_field.base, shape + of_field.shape, partial(array.__getitem__, field))
            yield from _items(unread, (*at, field), f"{name} {field}".strip(), unit)
        return
    axes = [axis for axis, count in enumerate(shape) if count != 1]
    if array.dtype.kind not in f"{_NUMBERS}mM" or len(axes) > 2 or 0 in shape:
        return
    unit = "s" if array.dtype.kind in "mM" else unit
    columns = min(axes, key=lambda axis: shape[axis]) if len(axes) == 2 else None
    for k in range(1 if columns is None else min(shape[columns], MOST_OBJECTS)):
        own = names[k] if len(names) > k else f"{name} {k + 1}".strip() if columns is not None else name or "1"
        index = tuple(k if axis == columns else slice(None) if axis in axes else 0 for axis in range(len(shape)))
        count = max((shape[axis] for axis in axes if axis != columns), default=1)
        yield Item(own, (*at, own) if names else at, unit, count, partial(array.__getitem__, index))


def _number(at: Sequence[str], value: Any) -> Iterator[Item]:
    """A number beside channels, if a value is one."""
    values = np.asarray(value)
    if values.size == 1 and values.dtype.kind in _NUMBERS:
        yield Item("/".join(at), tuple(at), "", 1, lambda: values)


def _whole(path: Path) -> Path:
    """A file that its library reads whole; `InputError` if it, or what it unpacks to, is too large."""
    if unpacked_bytes(path) > MOST_BYTES:
        raise InputError(f"{path}: the file holds more than {MOST_BYTES / 1e6:.0f} MB; give a part of it.")
    return path


def _require_samples(path: Path, name: str, count: int, stated: float) -> None:
    """Refuse a channel of fewer samples than the file states."""
    if count < stated:
        raise InputError(
            f"{path}: states {stated:g} samples of {shown(name)} and holds {count}, so it was cut off; export it "
            f"again, or write {count} for {stated:g} to read what is left."
        )


def _unique(name: str, number: int, names: Iterable[str]) -> str:
    """The name of a group, with its number where it has none or another one has it, too."""
    return name if name and name not in names else f"{name or 'group'} {number}"


@contextmanager
def _mdf(path: Path) -> Iterator[dict[str, list[Item]]]:
    with required("asammdf").MDF(path) as file:
        groups: dict[str, list[Item]] = {}
        for index, group in enumerate(file.groups):
            items: list[Item] = []
            count = group.channel_group.cycles_nr
            for k, channel in enumerate(group.channels if count > 1 else ()):
                if k != file.masters_db.get(index):
                    first = file.get(group=index, index=k, record_count=1)
                    load = partial(_signal, file, index, k)
                    samples = _Unread(first.samples.dtype, (count, *first.samples.shape[1:]), load)
                    items += _items(samples, (channel.name,), channel.name, first.unit or "")
            if items:
                items.append(Item("time", ("time",), "s", count, partial(file.get_master, index)))
            name = str(getattr(group.channel_group, "acq_name", "") or "")
            groups[_unique(name, index + 1, groups)] = items
        yield groups


def _signal(file, group: int, channel: int) -> np.ndarray:
    return file.get(group=group, index=channel).samples


@contextmanager
def _tdms(path: Path) -> Iterator[dict[str, list[Item]]]:
    handler, lines = required("nptdms.log").log_manager.console_handler, StringIO()
    stream, handler.stream = handler.stream, lines  # it would write on the screen
    try:
        with required("nptdms").TdmsFile.open(path) as file:
            if lines.getvalue():
                warnings.warn(lines.getvalue(), UserWarning, stacklevel=1)
            groups: dict[str, list[Item]] = {}
            for group in file.groups():
                items = groups.setdefault(group.name, [])
                for channel in group.channels():
                    at = group.name, channel.name
                    if len(channel):
                        samples = _Unread(channel.dtype, (len(channel),), partial(channel.__getitem__, slice(None)))
                        items += _items(samples, at, channel.name, _unit(channel.properties))
                    items += _properties(at, channel.properties)
                items += [*_properties((), file.properties), *_properties((group.name,), group.properties)]
            yield groups
    finally:
        handler.stream = stream


def _properties(at: Sequence[str], properties: Mapping) -> Iterator[Item]:
    for key, value in properties.items():
        yield from _number((*at, key), value)


@contextmanager
def _lvm(path: Path) -> Iterator[dict[str, list[Item]]]:
    text = decoded(_whole(path).read_bytes())
    data = required("lvm_read").read_str(text)  # its `read` would open a pickle beside the file
    stated = re.search(r"^Separator(.)", text, re.MULTILINE)
    _require_fields(path, text, stated[1] if stated else "\t")
    groups: dict[str, list[Item]] = {}
    for segment in (data[k] for k in range(data["Segments"])):
        items: list[Item] = []
        table, names = segment["data"], segment["Channel names"]
        channels = [k for k, name in enumerate(names[: table.shape[1]]) if name not in ("X_Value", "Comment")]
        every = 2 if data.get("X_Columns") == "Multi" and len(segment.get("Delta_X", ())) > len(channels) else 1
        units, steps, counts = (segment.get(key, [])[::every] for key in ("Y_Unit_Label", "Delta_X", "Samples"))
        timed = (segment.get("X_Dimension") or ["Time"])[0] == "Time"
        for number, k in enumerate(channels):
            count = counts[number] if number < len(counts) else len(table)
            _require_samples(path, names[k], len(table), count)
            unit = units[number] if number < len(units) else ""
            items += _items(table[: int(count), k], (names[k],), names[k], unit)
            if timed and number < len(steps):
                items += _number((names[k], "sampling interval"), steps[number])
            # one column of stamps is that of the first channel, and of those that have as many samples and its step
            if timed and k and names[k - 1] == "X_Value":
                items += _items(table[: int(count), k - 1], (names[k], "time"), "time", "s")
        groups[_unique("", len(groups) + 1, groups)] = items
    yield groups


def _require_fields(path: Path, text: str, separator: str) -> None:
    """Refuse a row with more fields than names above it, or with a number for a comment."""
    names: list[str] = []
    for number, line in enumerate(text.split("\n"), 1):
        fields = line.rstrip(separator).split(separator)
        if not line.strip():
            names = []
        elif fields[0] == "X_Value":
            names = fields
        elif names:
            comment = fields[len(names) - 1] if names[-1] == "Comment" and len(fields) >= len(names) else ""
            if len(fields) > len(names) or NUMBER.fullmatch(comment.replace(",", ".")):
                raise InputError(
                    f"{path}: line {number} ({shown(line)}) has a field too many below {', '.join(map(shown, names))}; "
                    "correct or remove it."
                )


@contextmanager
def _uff(path: Path) -> Iterator[dict[str, list[Item]]]:
    file = required("pyuff").UFF(str(_whole(path)))
    sets = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if str(kind).startswith("58")]
    # time responses, or of an unknown kind over time
    sets = [dataset for dataset in sets if dataset["func_type"] in (0, 1) and not np.iscomplexobj(dataset["data"])]
    names = [str(dataset["id1"]).strip() for dataset in sets]
    if len(set(names)) < len(names):
        names = [f"node {dataset['rsp_node']} {_direction(dataset['rsp_dir'])}" for dataset in sets]
    if len(set(names)) < len(names):
        names = [f"{name} {k + 1}" for k, name in enumerate(names)]
    groups: dict[bytes, list[Item]] = {}
    for dataset, name in zip(sets, names, strict=True):
        _require_samples(path, name, len(dataset["data"]), dataset["num_pts"])
        stamps = np.asarray(dataset["x"])
        even = bool(dataset["abscissa_spacing"])
        items = groups.setdefault(b"" if even else stamps.tobytes(), [])
        label = str(dataset.get("ordinate_axis_units_lab", "")).strip()
        if even:
            items += _number((name, "sampling interval"), dataset["abscissa_inc"])
        elif not items:
            items += _items(stamps, ("time",), "time", "s")
        items += _items(dataset["data"], (name,), name, "" if label.upper() == "NONE" else label)
    yield {f"group {k + 1}": items for k, items in enumerate(groups.values())}


def _direction(number: float) -> str:
    letter = "XYZ"[(abs(int(number)) - 1) % 3] if number else ""
    return f"{'-' if number < 0 else '+'}{letter}" if letter else "scalar"


@contextmanager
def _mat(path: Path) -> Iterator[dict[str, list[Item]]]:
    arrays, others = read_mat(_whole(path))
    if others and not any(values.size > 1 for values in arrays.values()):
        raise InputError(
            f"{path}: holds no arrays of numbers but {', '.join(map(shown, others[:8]))}, such as a table or a "
            "timetable, which only MATLAB reads; save its columns as arrays, ay = T.ay; save record.mat ay -v7."
        )
    yield {"": [item for name, values in arrays.items() for item in _items(values, name.split("."), name)]}


@contextmanager
def _hdf5(path: Path) -> Iterator[dict[str, list[Item]]]:
    library = required("h5py")
    with library.File(path, "r") as file:
        items, seen = list(_properties((), file.attrs)), []

        def visit(name, one):
            seen.append(name)
            at = tuple(name.split("/"))
            if len(at) > MOST_NESTED or len(seen) > MOST_OBJECTS:
                raise InputError(
                    f"{path}: holds more than {MOST_OBJECTS} datasets and groups, or {MOST_NESTED} within each other; "
                    "export the channels of the sensor alone."
                )
            items.extend(_properties(at, one.attrs))
            # other files may stand behind external and virtual datasets
            if isinstance(one, library.Dataset) and not one.external and not one.is_virtual:
                names = next((list(one.attrs[key]) for key in _NAMES if key in one.attrs), [])
                names = [text.decode() if isinstance(text, bytes) else str(text) for text in names]
                items.extend(_items(_Scaled(one), at, name, _unit(one.attrs), names))

        file.visititems(visit)
        yield {"": items}


class _Scaled:
    """A dataset whose numbers are a factor and an offset away, as the conventions for climate data write it."""

    def __init__(self, dataset) -> None:
        self.dataset, self.dtype, self.shape = dataset, dataset.dtype, dataset.shape or (0,)

    def __getitem__(self, index):
        values = self.dataset[index]
        stated = {key: np.ravel(value)[0] for key, value in self.dataset.attrs.items() if key in _SCALED}
        if not stated:
            return values
        scaled = values * stated.get("scale_factor", 1.0) + stated.get("add_offset", 0.0)
        return np.where(values == stated["_FillValue"], np.nan, scaled) if "_FillValue" in stated else scaled


def _unit(properties: Mapping) -> str:
    unit = next((properties[key] for key in _UNITS if key in properties), "")
    return unit.decode() if isinstance(unit, bytes) else unit if isinstance(unit, str) else ""


@contextmanager
def _wav(path: Path) -> Iterator[dict[str, list[Item]]]:
    rate, values = required("scipy.io.wavfile").read(_whole(path))
    form = re.search(rb"fmt .{18}(..)", path.read_bytes()[:_WAV_HEAD], re.DOTALL)
    bits = int.from_bytes(form[1], "little") if form and values.dtype.kind in "iu" else 0
    if bits == 8:
        values = values.astype(np.int16) - 128  # their zero
    elif bits == 24:
        values = values >> 8  # they come at the top of 32
    yield {"": [*_items(values, ()), *_number(("sample rate",), rate), *_number(_BITS, bits)]}


@contextmanager
def _npy(path: Path) -> Iterator[dict[str, list[Item]]]:
    yield {"": list(_items(np.load(path, mmap_mode="r", allow_pickle=False), ()))}


@contextmanager
def _parquet(path: Path) -> Iterator[dict[str, list[Item]]]:
    with required("pyarrow.parquet").ParquetFile(path) as file:
        items: list[Item] = []
        schema, types = file.schema_arrow, required("pyarrow").types
        for k, column in enumerate(schema):
            numbers = types.is_integer(column.type) or types.is_floating(column.type)
            if not (numbers or types.is_timestamp(column.type)):
                continue
            kind = np.dtype(column.type.to_pandas_dtype() if numbers else "M8[ns]")
            name = "time" if column.name.startswith("__index_level_") else column.name
            number = schema.names[:k].count(column.name)
            samples = _Unread(kind, (file.metadata.num_rows,), partial(_parquet_column, file, column.name, number))
            items += _items(samples, (name,), name)
        yield {"": items}


def _parquet_column(file, name: str, number: int) -> np.ndarray:
    """A column, the ``number``-th of its name."""
    table = file.read(columns=[name], use_pandas_metadata=False)
    return table.column(min(number, table.num_columns - 1)).to_numpy()


FORMATS = (
    Format("MDF", "asammdf", _mdf, re.compile(rb"MDF     [2-4]\."), (".mf4", ".mdf")),
    Format("TDMS", "nptdms", _tdms, re.compile(rb"TDSm"), (".tdms",)),
    Format("LVM", "lvm_read", _lvm, re.compile(rb"(\xef\xbb\xbf)?LabVIEW Measurement"), ()),
    Format("UFF 58", "pyuff", _uff, re.compile(rb"\s*    -1\s*\r?\n\s*\d{1,4}b?\s"), (".uff", ".unv", ".uf")),
    Format("HDF5", "h5py", _hdf5, re.compile(rb"\x89HDF\r\n\x1a\n|MATLAB 7\.3"), (".h5", ".hdf5", ".hdf")),
    Format("MAT", "scipy.io", _mat, re.compile(rb"MATLAB 5"), (".mat",)),
    Format("WAV", "scipy.io.wavfile", _wav, re.compile(rb"RIFF|RIFX|RF64"), (".wav",)),
    Format("NPY", "numpy", _npy, re.compile(rb"\x93NUMPY"), (".npy",)),
    Format("Parquet", "pyarrow", _parquet, re.compile(rb"PAR1"), (".parquet", ".pq")),
)
