"""Records of loggers in formats of their own, each turned into one table by the library of its format.

A format is recognised by how its files begin, or else by their ending.
What has no format of its own is text (`trackdyn.sensor.logger_text`).
"""

import gc
import gzip
import re
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy  # its parts are loaded where they are used

from trackdyn.errors import InputError, shown
from trackdyn.extras import required
from trackdyn.files import plain_file
from trackdyn.sensor.sensor_mapping import NAME_IT

MOST_BYTES = 128_000_000  # an hour of three axes at 1 kHz; the text and its numbers take some ten times that
_WIDE = (b"\xff\xfe", b"\xfe\xff")  # marks of UTF-16
_HEAD = 600  # bytes by which a format is recognised
# names of a number that is the samples a second, or the time between two of them
_RATE = re.compile(r"(.*[._ ])?(fs|(sampl(e|ing)[_ ]?)?rate|sampl(e|ing)[_ ]?freq(uency)?)(_?hz)?", re.IGNORECASE)
_INTERVAL = re.compile(
    r"(.*[._ ])?(dt|delta_?[tx]|sampl(e|ing)[_ ]?(interval|time)|(wf_)?increment)(_?s)?", re.IGNORECASE
)
_UNITS = ("unit", "units", "unit_string", "NI_UnitDescription")
_NAMES = ("names", "columns", "column_names", "channels", "channel_names", "labels")
_NUMBERS = "iufb"
Item = tuple[str, str, Any]  # name, unit and samples of a channel, or of several as a table


class Channels(NamedTuple):
    """Channels of one group, which share their samples."""

    path: Path  # the file
    # names, units: of the channels, in their order in the file; stamps that stand apart come last, as ``time``
    names: list[str]
    units: list[str]
    values: np.ndarray  # (c, N) their samples
    rate: float | None = None  # samples a second that the file states beside its samples, Hz
    first_line: int = 1  # number of the first sample, from 1
    left_out: tuple[str, ...] = ()  # as in `logger_text.Layout`

    def first(self, column: int) -> str:
        """The first sample of a channel."""
        return f"{self.values[column, 0]:g}"

    def table(self, columns: Sequence[int], gaps: bool = False) -> np.ndarray:
        """(N, c) numbers of some channels; `InputError` names the first that is not finite (``gaps``: is infinite)."""
        table = self.values[list(columns)].T
        wrong = np.isinf(table) if gaps else ~np.isfinite(table)
        if wrong.any():
            row, index = np.argwhere(wrong)[0]
            name = self.names[columns[index]]
            raise InputError(
                f"{self.path}: channel {name!r} is {table[row, index]} in sample {row + 1}; give a record without "
                "gaps, or --gaps bridge or --gaps longest."
            )
        return table


class Format(NamedTuple):
    """A format of files: what it is called, what reads it, and how its files begin and end."""

    name: str
    package: str
    read: Callable[[Path], Iterable[Channels]]
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
    A file packed by gzip is unpacked; comments stand behind ``#``, whatever the file has.
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
    control = sum(byte < 32 and byte not in b"\t\n\v\f\r\x1a" for byte in data[:1000])
    if control > 0.02 * len(data[:1000]) and not data.startswith(_WIDE):
        read = ", ".join(form.name for form in FORMATS)
        raise InputError(f"{path}: this is binary data, not text, and none of {read}; export it as CSV.")
    if len(data) > MOST_BYTES:
        raise InputError(f"{path}: the file holds more than {MOST_BYTES / 1e6:.0f} MB; give a part of it.")
    text = decoded(data)
    # rows of files that have their comments behind another sign do not hold it
    mark = next((mark for mark in (";", "%", "//") if text.startswith(mark)), None)
    head = text.split("\n", 200)[:200]
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


def read_channels(path: Path, kind: Format, recognised: Callable[[Sequence[str]], bool], sought: str) -> Channels:
    """Read the one group of a file whose channels are ``recognised`` by their names.

    ``sought`` names in a refusal what is missing. Raises `InputError`: no file of this format or a damaged one, no
    such group or several, or a package is not installed.
    """
    plain_file(path, "record")
    required(kind.package)
    groups, failure = [], ""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None  # half-made objects complain when they are collected
    try:
        groups = list(kind.read(path))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # a library raises whatever a damaged file brings about
        failure = type(error).__name__
    finally:
        if failure:
            gc.collect()
        sys.unraisablehook = hook
    if failure:
        raise InputError(f"{path}: is no {kind.name} file or a damaged one ({failure}); export the record again.")
    usable = [group for group in groups if recognised(group.names)]
    names = [name for group in groups for name in group.names]
    if not usable:
        listed = ", ".join(map(shown, names[:20]))
        remedy = NAME_IT if names else "export the record as CSV"
        raise InputError(f"{path}: no {sought}; there are {listed or 'no channels'}; {remedy}.")
    if len(usable) > 1:
        raise InputError(
            f"{path}: {len(usable)} groups of channels have a {sought}; name a channel that only one of them has, such "
            f"as --axis ay={usable[0].names[0]!r}, or export one of them."
        )
    return usable[0]


def _groups(path: Path, items: Iterable[Item], rate: float | None = None) -> Iterator[Channels]:
    """Channels of the same number of samples; a table, (N, c) or (c, N), has a channel a column, ``name 1`` and so on.

    A single number that is called a rate or an interval is the ``rate``, if there is but one.
    """
    groups: dict[int, list[Item]] = {}
    rates = [] if rate is None else [rate]
    for name, unit, values in chain.from_iterable(map(_plain, items)):
        if values.ndim == 0:
            number = float(values)
            if number > 0 and _RATE.fullmatch(name):
                rates.append(number)
            elif number > 0 and _INTERVAL.fullmatch(name):
                rates.append(1 / number)
            continue
        table = values.T if values.ndim == 2 and values.shape[0] > values.shape[1] else values
        for k, column in enumerate(np.atleast_2d(table)):
            one = name if values.ndim == 1 else f"{name} {k + 1}".strip()
            groups.setdefault(column.size, []).append((one, unit, column))
    for count, channels in groups.items():
        if count > 1:
            names, units = [channel[0] for channel in channels], [channel[1] for channel in channels]
            table = np.array([channel[2] for channel in channels], dtype=float)
            yield Channels(path, names, units, table, rates[0] if len(set(rates)) == 1 else None)


def _plain(item: Item) -> Iterator[Item]:
    """The numbers of an item, without axes of length one; fields of records apart, instants as s since the first."""
    name, unit, samples = item
    values = np.squeeze(np.asarray(samples))
    if values.dtype.names:
        for field in values.dtype.names:
            yield from _plain((f"{name} {field}".strip(), unit, values[field]))
    elif values.dtype.kind == "M" and values.ndim == 1 and values.size:
        yield name, "s", (values - values[0]) / np.timedelta64(1, "s")
    elif values.dtype.kind in _NUMBERS and values.ndim <= 2 and values.size:
        yield name, unit, values


def _mdf(path: Path) -> Iterator[Channels]:
    with required("asammdf").MDF(path) as file:
        for index in range(len(file.groups)):
            signals = file.select([(None, index, k) for k in range(len(file.groups[index].channels))])
            master = file.get_master(index)
            items = [
                (signal.name, signal.unit or "", signal.samples)
                for signal in signals
                if signal.name.lower() not in ("time", "t")
            ]
            items = [item for item in items if item[2].ndim == 1 and item[2].size == master.size]
            yield from _groups(path, [*items, ("time", "s", master)])


def _tdms(path: Path) -> Iterator[Channels]:
    for group in required("nptdms").TdmsFile.read(path).groups():
        items, interval = [], None
        for channel in group.channels():
            interval = interval or channel.properties.get("wf_increment")
            items.append((channel.name, _unit(channel.properties), channel[:]))
        yield from _groups(path, items, 1 / interval if interval else None)


def _lvm(path: Path) -> Iterator[Channels]:
    # its `read` would open a pickle beside the file
    data = required("lvm_read").read_str(decoded(path.read_bytes()))
    for k in range(data["Segments"]):
        segment = data[k]
        names = segment["Channel names"][: segment["data"].shape[1]]
        labels = ["s"] * (names[0] == "X_Value") + list(segment.get("Y_Unit_Label", []))
        items = [
            (name, labels[at] if at < len(labels) else "", segment["data"][:, at])
            for at, name in enumerate(names)
            if name != "Comment"
        ]
        timed = (segment.get("X_Dimension") or ["Time"])[0] == "Time" and segment.get("Delta_X", [0])[0] > 0
        yield from _groups(path, items, 1 / segment["Delta_X"][0] if timed else None)


def _uff(path: Path) -> Iterator[Channels]:
    file = required("pyuff").UFF(str(path))
    sets = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if str(kind).startswith("58")]
    # time responses, or of an unknown kind over time
    sets = [dataset for dataset in sets if dataset["func_type"] in (0, 1) and not np.iscomplexobj(dataset["data"])]
    names = [str(dataset["id1"]).strip() for dataset in sets]
    if len(set(names)) < len(names):
        names = [f"node {dataset['rsp_node']} {_direction(dataset['rsp_dir'])}" for dataset in sets]
    if len(set(names)) < len(names):
        names = [f"{name} {k + 1}" for k, name in enumerate(names)]
    by_rate: dict[float, list[Item]] = {}
    for dataset, name in zip(sets, names, strict=True):
        label = str(dataset.get("ordinate_axis_units_lab", "")).strip()
        x = np.asarray(dataset["x"])
        step = float(dataset.get("abscissa_inc") or 0.0) or (x[-1] - x[0]) / (x.size - 1)
        by_rate.setdefault(step, []).append((name, "" if label.upper() == "NONE" else label, dataset["data"]))
    for step, items in by_rate.items():
        yield from _groups(path, items, 1 / step if step > 0 else None)


def _direction(number: float) -> str:
    letter = "XYZ"[(abs(int(number)) - 1) % 3] if number else ""
    return f"{'-' if number < 0 else '+'}{letter}" if letter else "scalar"


def _mat(path: Path) -> Iterator[Channels]:
    content = scipy.io.loadmat(path, simplify_cells=True)
    yield from _groups(path, _nested({name: item for name, item in content.items() if not name.startswith("__")}))


def _nested(content: Mapping, above: str = "") -> Iterator[Item]:
    for name, item in content.items():
        yield from _nested(item, f"{above}{name}.") if isinstance(item, Mapping) else [(f"{above}{name}", "", item)]


def _hdf5(path: Path) -> Iterator[Channels]:
    library = required("h5py")
    items: list[Item] = []
    with library.File(path, "r") as file:
        items += [(name, "", attribute) for name, attribute in file.attrs.items() if np.ndim(attribute) == 0]

        def visit(name, one):
            items.extend((key, "", value) for key, value in one.attrs.items() if np.ndim(value) == 0)
            if not isinstance(one, library.Dataset) or one.dtype.kind not in _NUMBERS + "V":
                return
            names = next((list(one.attrs[key]) for key in _NAMES if key in one.attrs), [])
            names = [text.decode() if isinstance(text, bytes) else str(text) for text in names]
            values = one[()]
            if values.ndim == 2 and len(names) == min(values.shape):
                columns = values.T if values.shape[0] > values.shape[1] else values
                items.extend((text, _unit(one.attrs), column) for text, column in zip(names, columns, strict=True))
            else:
                items.append((name, _unit(one.attrs), values))

        file.visititems(visit)
    yield from _groups(path, items)


def _unit(properties: Mapping) -> str:
    unit = next((properties[key] for key in _UNITS if key in properties), "")
    return unit.decode() if isinstance(unit, bytes) else unit if isinstance(unit, str) else ""


def _wav(path: Path) -> Iterator[Channels]:
    rate, values = required("scipy.io.wavfile").read(path)
    yield from _groups(path, [("", "", values.reshape(len(values), -1))], float(rate))


def _npy(path: Path) -> Iterator[Channels]:
    yield from _groups(path, [("", "", np.load(path, allow_pickle=False))])


def _parquet(path: Path) -> Iterator[Channels]:
    table = pd.read_parquet(path)
    table = table if isinstance(table.index, pd.RangeIndex) else table.reset_index(names=table.index.name or "time")
    numbers = {name: column for name, column in table.items() if column.dtype.kind in _NUMBERS + "M"}
    missing = {"dtype": float, "na_value": np.nan}
    yield from _groups(
        path,
        [
            (
                str(name),
                "",
                column.dt.tz_localize(None).to_numpy() if column.dtype.kind == "M" else column.to_numpy(**missing),
            )
            for name, column in numbers.items()
        ],
    )


FORMATS = (
    Format("MDF 4", "asammdf", _mdf, re.compile(rb"MDF     4\."), (".mf4",)),
    Format("TDMS", "nptdms", _tdms, re.compile(rb"TDSm"), (".tdms",)),
    Format("LVM", "lvm_read", _lvm, re.compile(rb"(\xef\xbb\xbf)?LabVIEW Measurement"), ()),
    Format("UFF 58", "pyuff", _uff, re.compile(rb"\s*    -1\s*\r?\n\s*\d{1,4}b?\s"), (".uff", ".unv", ".uf")),
    Format("HDF5", "h5py", _hdf5, re.compile(rb"\x89HDF\r\n\x1a\n|MATLAB 7\.3"), (".h5", ".hdf5", ".hdf")),
    Format("MAT", "scipy.io", _mat, re.compile(rb"MATLAB 5"), (".mat",)),
    Format("WAV", "scipy.io.wavfile", _wav, re.compile(rb"RIFF|RIFX|RF64"), (".wav",)),
    Format("NPY", "numpy", _npy, re.compile(rb"\x93NUMPY"), (".npy",)),
    Format("Parquet", "pyarrow", _parquet, re.compile(rb"PAR1"), (".parquet", ".pq")),
)
