"""Formats of loggers: what a file of each holds, by the library of the format.

A file is opened as groups of channels. How many samples a channel has is known before it is read.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trackdyn.errors import InputError, shown
from trackdyn.extras import required
from trackdyn.sensor.logger_text import NUMBER
from trackdyn.sensor.mat_file import read_mat, unpacked_bytes

# in a file, packed or unpacked: an hour of three axes at 1 kHz; the text and its numbers take some ten times that
MOST_BYTES = 128_000_000
MOST_OBJECTS = 2_000  # datasets and groups of an HDF5 file
MOST_NESTED = 20  # groups within groups
WIDE = (b"\xff\xfe", b"\xfe\xff")  # marks of UTF-16
_HEAD = 600  # bytes by which a format is recognised
_WAV_HEAD = 10_000  # bytes of a WAV file in which its form is stated
_UNITS = ("unit", "units", "unit_string", "NI_UnitDescription")
_NAMES = ("names", "columns", "column_names", "channels", "channel_names", "labels")
_SCALED = ("scale_factor", "add_offset", "_FillValue")  # attributes of a dataset that change its numbers
BITS = "bits in a sample of the file"
_NUMBERS = "iuf"


class Item(NamedTuple):
    """A channel of a file, or a number that stands beside channels."""

    name: str
    at: tuple[str, ...]  # where it stands: names of groups from the file down, the last one its own
    unit: str
    size: int  # samples; 1: a number
    load: Callable[[], np.ndarray]  # reads them


Groups = Mapping[str, Iterable[Item]]  # channels of a file by the name of their group


class Format(NamedTuple):
    """A format of files: what it is called, what reads it, and how its files begin and end.

    ``read`` opens a file, for as long as an `ExitStack` is open, and gives its groups.
    """

    name: str
    package: str
    read: Callable[[Path, ExitStack], Groups]
    begins: re.Pattern[bytes]
    endings: tuple[str, ...]


def format_of(path: Path) -> Format | None:
    """The format of a file; None for text, for a format that is not read, and for what is no file."""
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD) if path.is_file() else b""
    except (OSError, ValueError):
        head = b""
    if by_content := [form for form in FORMATS if form.begins.match(head)]:
        return by_content[0]
    text = head and not re.search(rb"[\0-\x08\x0e-\x19\x1b-\x1f]", head)
    return next((form for form in FORMATS if path.suffix.lower() in form.endings and not text), None)


def decoded(data: bytes) -> str:
    """Text of a file with plain newlines."""
    try:
        text = data.decode("utf-16" if data.startswith(WIDE) else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
        if re.search("[\x80-\x9f]", text[:10_000]):  # no letters of Latin-1, but halves of Japanese ones
            with suppress(UnicodeDecodeError):
                text = data.decode("cp932")
    return text.replace("\r\n", "\n").replace("\r", "\n")


class _Unread(NamedTuple):
    """An array that is read where it is indexed."""

    dtype: np.dtype
    shape: tuple[int, ...]
    read: Callable[[Any], np.ndarray]  # by index

    def __getitem__(self, index):
        return self.read(index)


def _items(array, at: Sequence[str], name: str = "", unit: str = "", names: Sequence[str] = ()) -> Iterator[Item]:
    """Channels of an array, or of what has its shape and type and is read where it is indexed.

    A table, (N, c) or (c, N), has a channel a column, ``name 1`` and so on or by ``names``; records have one a field.
    Axes of length one do not count; texts and truth values are no channels.
    """
    at, shape = tuple(at) or ("1",), tuple(array.shape)
    if array.dtype.names:
        for field in array.dtype.names:
            own = array.dtype[field]
            unread = _Unread(own.base, shape + own.shape, partial(_field, array, field))
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


def _field(records, name: str, index: Any) -> np.ndarray:
    return records[name][index]


def _numbers(at: Sequence[str], properties: Mapping[str, Any]) -> Iterator[Item]:
    """Numbers beside channels, out of the properties of what stands at ``at``."""
    for key, value in properties.items():
        values = np.asarray(value)
        if values.size == 1 and values.dtype.kind in _NUMBERS:
            yield Item(key, (*at, key), "", 1, partial(np.asarray, value))


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


def _mdf(path: Path, opened: ExitStack) -> Groups:
    file = opened.enter_context(required("asammdf").MDF(path))
    groups: dict[str, list[Item]] = {}
    for index, group in enumerate(file.groups):
        items: list[Item] = []
        count = group.channel_group.cycles_nr
        for k, channel in enumerate(group.channels if count > 1 else ()):
            if k != file.masters_db.get(index):
                first = file.get(group=index, index=k, record_count=1)
                read = partial(_signal, file, index, k)
                samples = _Unread(first.samples.dtype, (count, *first.samples.shape[1:]), read)
                items += _items(samples, (channel.name,), channel.name, first.unit or "")
        if items:
            items.append(Item("time", ("time",), "s", count, partial(file.get_master, index)))
        name = str(getattr(group.channel_group, "acq_name", "") or "")
        # its number where it has no name or another one has it, too
        groups[name if name and name not in groups else f"{name or 'group'} {index + 1}"] = items
    return groups


def _signal(file, group: int, channel: int, index: Any) -> np.ndarray:
    return file.get(group=group, index=channel).samples[index]


def _tdms(path: Path, opened: ExitStack) -> Groups:
    file = opened.enter_context(required("nptdms").TdmsFile.open(path))
    groups: dict[str, list[Item]] = {}
    for group in file.groups():
        items = groups.setdefault(group.name, [])
        for channel in group.channels():
            at = group.name, channel.name
            if len(channel):
                samples = _Unread(channel.dtype, (len(channel),), partial(_channel, channel))
                items += _items(samples, at, channel.name, _unit(channel.properties))
            items += _numbers(at, channel.properties)
        items += [*_numbers((), file.properties), *_numbers((group.name,), group.properties)]
    return groups


def _channel(channel, index: Any) -> np.ndarray:
    return channel[:][index]


def _lvm(path: Path, opened: ExitStack) -> Groups:
    text = decoded(_whole(path).read_bytes())
    data = required("lvm_read").read_str(text)  # its `read` would open a pickle beside the file
    stated = re.search(r"^Separator(.)", text, re.MULTILINE)
    _require_fields(path, text, stated[1] if stated else "\t")
    groups: dict[tuple[int, bytes], list[Item]] = {}
    for index in range(data["Segments"]):
        segment, stamps = data[index], np.empty(0)
        table, names = segment["data"], segment["Channel names"]
        channels = [k for k, name in enumerate(names[: table.shape[1]]) if name not in ("X_Value", "Comment")]
        every = 2 if data.get("X_Columns") == "Multi" and len(segment.get("Delta_X", ())) > len(channels) else 1
        units, steps, counts = (segment.get(key, [])[::every] for key in ("Y_Unit_Label", "Delta_X", "Samples"))
        timed = (segment.get("X_Dimension") or ["Time"])[0] == "Time"
        for number, k in enumerate(channels):
            count = counts[number] if number < len(counts) else len(table)
            _require_samples(path, names[k], len(table), count)
            unit = units[number] if number < len(units) else ""
            # one column of stamps is that of the first channel, and of those that have as many samples and its step
            if timed and k and names[k - 1] == "X_Value":
                stamps = table[: int(count), k - 1]
            items = groups.setdefault((index, stamps.tobytes()), [])
            if not items:
                items += _items(stamps, (names[k], "time"), "time", "s")
            items += _items(table[: int(count), k], (names[k],), names[k], unit)
            if timed and number < len(steps):
                items += _numbers((names[k],), {"sampling interval": steps[number]})
    return {f"group {k + 1}": items for k, items in enumerate(groups.values())}


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


def _uff(path: Path, opened: ExitStack) -> Groups:
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
            items += _numbers((name,), {"sampling interval": dataset["abscissa_inc"]})
        elif not items:
            items += _items(stamps, ("time",), "time", "s")
        items += _items(dataset["data"], (name,), name, "" if label.upper() == "NONE" else label)
    return {f"group {k + 1}": items for k, items in enumerate(groups.values())}


def _direction(number: float) -> str:
    letter = "XYZ"[(abs(int(number)) - 1) % 3] if number else ""
    return f"{'-' if number < 0 else '+'}{letter}" if letter else "scalar"


def _mat(path: Path, opened: ExitStack) -> Groups:
    arrays, others = read_mat(_whole(path))
    if others and not any(values.size > 1 for values in arrays.values()):
        raise InputError(
            f"{path}: holds no arrays of numbers but {', '.join(map(shown, others[:8]))}, such as a table or a "
            "timetable, which only MATLAB reads; save its columns as arrays, ay = T.ay; save record.mat ay -v7."
        )
    return {"": [item for name, values in arrays.items() for item in _items(values, name.split("."), name)]}


def _hdf5(path: Path, opened: ExitStack) -> Groups:
    library = required("h5py")
    file = opened.enter_context(library.File(path, "r"))
    items, seen = list(_numbers((), file.attrs)), []

    def visit(name, item):
        seen.append(name)
        at = tuple(name.split("/"))
        if len(at) > MOST_NESTED or len(seen) > MOST_OBJECTS:
            raise InputError(
                f"{path}: holds more than {MOST_OBJECTS} datasets and groups, or {MOST_NESTED} within each other; "
                "export the channels of the sensor alone."
            )
        items.extend(_numbers(at, item.attrs))
        # other files may stand behind external and virtual datasets
        if isinstance(item, library.Dataset) and not item.external and not item.is_virtual:
            names = next((list(item.attrs[key]) for key in _NAMES if key in item.attrs), [])
            names = [text.decode() if isinstance(text, bytes) else str(text) for text in names]
            unread = _Unread(item.dtype, item.shape or (0,), partial(_scaled, item))
            items.extend(_items(unread, at, name, _unit(item.attrs), names))

    file.visititems(visit)
    return {"": items}


def _scaled(dataset, index: Any) -> np.ndarray:
    """Numbers of a dataset, which may be a factor and an offset away, as the conventions for climate data write it."""
    values = dataset[index]
    stated = {key: np.ravel(value)[0] for key, value in dataset.attrs.items() if key in _SCALED}
    if not stated:
        return values
    scaled = values * stated.get("scale_factor", 1.0) + stated.get("add_offset", 0.0)
    return np.where(values == stated["_FillValue"], np.nan, scaled) if "_FillValue" in stated else scaled


def _unit(properties: Mapping) -> str:
    unit = next((properties[key] for key in _UNITS if key in properties), "")
    return unit.decode() if isinstance(unit, bytes) else unit if isinstance(unit, str) else ""


def _wav(path: Path, opened: ExitStack) -> Groups:
    rate, values = required("scipy.io.wavfile").read(_whole(path))
    form = re.search(rb"fmt .{18}(..)", path.read_bytes()[:_WAV_HEAD], re.DOTALL)
    bits = int.from_bytes(form[1], "little") if form and values.dtype.kind in "iu" else 0
    if bits == 8:
        values = values.astype(np.int16) - 128  # their zero
    elif bits == 24:
        values = values >> 8  # they come at the top of 32
    return {"": [*_items(values, ()), *_numbers((), {"sample rate": rate, BITS: bits})]}


def _npy(path: Path, opened: ExitStack) -> Groups:
    return {"": list(_items(np.load(path, mmap_mode="r", allow_pickle=False), ()))}


def _parquet(path: Path, opened: ExitStack) -> Groups:
    file, types = opened.enter_context(required("pyarrow.parquet").ParquetFile(path)), required("pyarrow").types
    items: list[Item] = []
    schema = file.schema_arrow
    for k, column in enumerate(schema):
        numbers = types.is_integer(column.type) or types.is_floating(column.type)
        if numbers or types.is_timestamp(column.type):
            kind = np.dtype(column.type.to_pandas_dtype() if numbers else "M8[ns]")
            name = "time" if column.name.startswith("__index_level_") else column.name
            read = partial(_parquet_column, file, column.name, schema.names[:k].count(column.name))
            items += _items(_Unread(kind, (file.metadata.num_rows,), read), (name,), name)
    return {"": items}


def _parquet_column(file, name: str, number: int, index: Any) -> np.ndarray:
    """A column, the ``number``-th of its name."""
    table = file.read(columns=[name], use_pandas_metadata=False)
    return table.column(min(number, table.num_columns - 1)).to_numpy()[index]


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
