"""Records of loggers that are no text: ASAM MDF 4 (.mf4) by asammdf, and TDMS (.tdms) by npTDMS."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError
from trackdyn.extras import required
from trackdyn.files import plain_file


class Channels(NamedTuple):
    """Channels of one group, which share their samples."""

    path: Path  # the file
    # names, units: of the channels. The time of the samples is a channel ``time`` in s if the file holds it otherwise
    names: list[str]
    units: list[str]
    values: np.ndarray  # (c, N) their samples
    first_line: int = 1  # number of the first sample, from 1

    def first(self, column: int) -> str:
        """The first sample of a channel."""
        return f"{self.values[column, 0]:g}"

    def table(self, columns: Sequence[int]) -> np.ndarray:
        """(N, c) numbers of some channels; `InputError` with the first sample that is not finite."""
        table = self.values[list(columns)].T
        if not np.isfinite(table).all():
            row, place = np.argwhere(~np.isfinite(table))[0]
            name = self.names[columns[place]]
            raise InputError(
                f"{self.path}: channel {name!r} is {table[row, place]} in sample {row + 1}; give a record without gaps"
            )
        return table


def read_channels(path: Path, recognised: Callable[[Sequence[str]], bool], sought: str) -> Channels:
    """Read the one group of a file whose channels are ``recognised`` by their names.

    ``sought`` says in a refusal what was not found. Raises `InputError`: no file of this format or a damaged one, no
    such group or several, or a package is not installed.
    """
    plain_file(path, "record")
    tdms = path.suffix.lower() == ".tdms"
    required("nptdms" if tdms else "asammdf")
    try:
        groups = list((_tdms_groups if tdms else _mdf_groups)(path))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # either package raises whatever a damaged file brings about
        kind = "TDMS" if tdms else "MDF 4"
        raise InputError(f"{path}: is no {kind} file or a damaged one ({type(error).__name__})") from None
    found = [group for group in groups if recognised(group.names)]
    names = [name for group in groups for name in group.names]
    if not found:
        raise InputError(f"{path}: no {sought}; there are {', '.join(map(repr, names[:20])) or 'no channels'}")
    if len(found) > 1:
        raise InputError(
            f"{path}: {len(found)} groups of channels have a {sought}; export one of them, or name its channel"
        )
    return found[0]


def _mdf_groups(path: Path) -> Iterator[Channels]:
    with open(path, "rb") as opened:
        head = opened.read(68)
    # asammdf leaves a half-made object behind that complains when it is collected
    if not head.startswith(b"MDF     4.") or head[64:] != b"##HD":
        raise ValueError("neither its identification nor its header is that of MDF 4")
    with required("asammdf").MDF(path) as file:
        for index in range(len(file.groups)):
            signals = file.select([(None, index, k) for k in range(len(file.groups[index].channels))])
            master = file.get_master(index)
            numbers = [one for one in signals if one.samples.ndim == 1 and one.samples.dtype.kind in "iuf"]
            numbers = [
                one for one in numbers if one.samples.size == master.size and one.name.lower() not in ("time", "t")
            ]
            yield _channels(path, [(one.name, one.unit or "", one.samples) for one in numbers], master)


def _tdms_groups(path: Path) -> Iterator[Channels]:
    for group in required("nptdms").TdmsFile.read(path).groups():
        numbers = [one for one in group.channels() if one[:].dtype.kind in "iuf" and len(one)]
        longest = max(map(len, numbers), default=0)
        numbers = [one for one in numbers if len(one) == longest]
        properties = numbers[0].properties if numbers else {}
        units = [one.properties.get("unit_string") or one.properties.get("NI_UnitDescription") or "" for one in numbers]
        # the time that a waveform has beside its samples; else it is a channel, or the user gives the rate
        timed = properties.get("wf_increment")
        master = properties.get("wf_start_offset", 0.0) + timed * np.arange(longest) if timed else None
        yield _channels(path, [(one.name, unit, one[:]) for one, unit in zip(numbers, units, strict=True)], master)


def _channels(path: Path, channels: Sequence[tuple[str, str, np.ndarray]], time: np.ndarray | None) -> Channels:
    rows = [*channels] if time is None else [("time", "s", time), *channels]
    values = np.array([np.asarray(samples, dtype=float) for _, _, samples in rows])
    return Channels(path, [name for name, _, _ in rows], [unit for _, unit, _ in rows], values)
