"""Options of several commands, and their parsers, which refuse invalid values before a command begins."""

import os
import re
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import isfinite, nan
from pathlib import Path
from typing import Annotated, Any

import typer

from trackdyn.commands.own_files import Input, is_own
from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.files import check_writable
from trackdyn.measure.catalogue import TOLERATED

DEFAULT_RIG = "paper"


def parse_number(name: str, text: str | float, accepted: str = "must be a finite number") -> float:
    """Parse a finite number; ``name`` is the option. Raises `InputError`: the text is no number."""
    from trackdyn.inputs.validation import parse_number as parse  # imports libraries that help does not need

    with suppress(ValueError):
        if isfinite(number := parse(text)):
            return number
    raise InputError(f"{name} = {shown(text)}: {accepted}")


def parsed(name: str, parser: Callable, metavar: str, help: str) -> Any:
    """Return an option whose value ``parser`` makes of its text."""
    return typer.Option(name, parser=parser, metavar=metavar, help=help)


def parse_quantity(name: str, text: str | float, units: Mapping[str, float], accepted: str) -> float:
    """Return a number from 0 on in SI units, else `InputError`; one of the ``units`` must follow it, but for 0."""
    number, unit = re.fullmatch(rf"\s*(.*?)\s*({'|'.join(filter(None, units))}|)\s*", str(text)).groups()
    value = parse_number(name, number, accepted)
    if value < 0 or (value and unit not in units):
        raise InputError(f"{name} = {shown(text)}: {accepted}")
    return value * units.get(unit, 1.0)


def parse_load(text: str | float) -> float:
    """Parse ``3kN``, ``3000N`` or ``3000``, return N. Raises `InputError`: it is no force from 0 on."""
    accepted = "must be a force from 0 on in N or kN, such as 3kN"
    return parse_quantity("--load", text, {"kN": 1e3, "N": 1.0, "": 1.0}, accepted)


def repeatable(name: str, metavar: str, help: str, **more: Any) -> Any:
    """Return an option that may be given several times."""
    return typer.Option(name, metavar=metavar, help=f"{help} Repeatable.", **more)


def number(name: str, help: str) -> Any:
    """Return an option of a finite number."""
    return parsed(name, lambda text: parse_number(name, text), "NUMBER", help)


def _parse_ring(text: str | float) -> float:
    """Parse a radius, return m; NaN for no ring. Raises `InputError`: it is no number."""
    accepted = "must be a radius in m, such as 0.308, or none"
    return nan if text == "none" else parse_number("--ring-radius", text, accepted)


def _parse_share(name: str, text: str | float, example: str, whole: bool) -> float:
    """Parse ``2%``, ``0.02`` or 0.02 as a share between 0 and 1 (1 included if ``whole``), else `InputError`."""
    number, percent = str(text).strip().removesuffix("%"), str(text).strip().endswith("%")
    accepted = f"must be {'above 0 and at most 1' if whole else 'between 0 and 1'}, such as {example}"
    share = parse_number(name, number, accepted) / (100 if percent else 1)
    if 0 < share < 1 or (whole and share == 1):
        return share
    raise InputError(f"{name} = {shown(text)}: {accepted}")


def share(name: str, example: str, help: str, whole: bool = False) -> Any:
    """Return an option of a share."""
    return parsed(name, lambda text: _parse_share(name, text, example, whole), "SHARE", help)


def _parse_file(name: str, text: str | Path, endings: tuple[str, ...]) -> Path:
    if (path := Path(text)).suffix not in endings:
        raise InputError(f"{name} = {shown(str(path))}: the name must end in {' or '.join(endings)}")
    return path


def file_argument(help: str, *endings: str) -> Any:
    """Return the argument OUT, a file to write with one of some endings."""
    help = f"{help} ({', '.join(endings)})."
    return typer.Argument(parser=lambda text: _parse_file("OUT", text, endings), metavar="OUT", help=help)


def file_option(name: str, help: str, *endings: str) -> Any:
    """Return an option of a file to write with one of some endings."""
    help = f"{help} ({', '.join(endings)})."
    return parsed(name, lambda text: _parse_file(name, text, endings), "FILE", help)


def check_output(path: Path, overwrite: bool, *inputs: Input, size: float = 0.0) -> None:
    """Refuse (`InputError`) an output that is an input, cannot be written (``size`` bytes) or may not be replaced."""
    for file in inputs:
        if isinstance(file, Path | str) and os.path.realpath(file) == os.path.realpath(path):
            raise InputError(f"{path} is an input of this command; give the output another name")
    check_writable(path, size)
    if path.exists() and not overwrite and not is_own(path, inputs):
        raise InputError(f"{path} exists; give another name, or --overwrite to replace it")


def _rigs() -> list[str]:
    """Return included rigs for the completion of a shell, which offers files if none matches."""
    from trackdyn.rig.rig_file import shipped_rigs

    return list(shipped_rigs())


_RIG = "Rig: a file, or the name of an included one (trackdyn rigs)."
RigName = Annotated[str, typer.Option("--rig", metavar="RIG", help=_RIG, autocompletion=_rigs)]
RigArgument = Annotated[str, typer.Argument(metavar="RIG", help=_RIG, autocompletion=_rigs)]
SpeedOption = Annotated[float, number("--rpm", "Motor speed, rev/min.")]
_RING = "Radius of the rubber ring in m, or none; the rig's by default."
RingRadius = Annotated[float | None, parsed("--ring-radius", _parse_ring, "NUMBER|none", _RING)]
_LOAD = "Pull of the chain by a brake, such as 3kN; the rig's, usually none, by default."
Load = Annotated[float | None, parsed("--load", parse_load, "FORCE", _LOAD)]
StepOption = Annotated[float | None, number("--step", "Time step, s; the preset's by default.")]
_SHARE = "2% or 0.02"
Tolerance = Annotated[float | None, share("--tolerance", _SHARE, f"Error of a measure, such as {_SHARE}.")]
_MEASURES = f"{', '.join(TOLERATED[:-1])} or {TOLERATED[-1]}."
Measures = Annotated[list[str] | None, repeatable("--measure", "NAME", _MEASURES, autocompletion=lambda: [*TOLERATED])]
_PITCHES = "Pitch of the chain, from 1, whose contact forces are recorded; the sensor's by default."
Pitches = Annotated[list[int] | None, repeatable("--pitch", "PITCH", _PITCHES)]
_JOBS = "Processes; all cores by default."
Jobs = Annotated[int | None, typer.Option("--jobs", "-j", min=1, max=1024, metavar="COUNT", help=_JOBS)]
_PRESETS = ["fast", "standard", "paper", "reference"]
_PRESET = "Bundle of choices: fast, standard, paper or reference; by default standard, or that of --tolerance."
Preset = Annotated[str | None, typer.Option(metavar="NAME", autocompletion=lambda: _PRESETS, help=_PRESET)]
_RATE = "Samples per second, Hz, such as your sensor's; the rig's by default. The step follows."
Rate = Annotated[float | None, number("--rate", _RATE)]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")]
_RECORDING = "Recording made by `trackdyn simulate` (.npz)."
RecordingFile = Annotated[Path, typer.Argument(metavar="RECORDING", help=_RECORDING)]
_CHOICE = "Choice of fidelity, such as chain=single_pin."
Choose = Annotated[list[str] | None, repeatable("--choose", "NAME=SETTING", _CHOICE)]
LongestRun = Annotated[float, number("--longest", "Bound of a run with a --tolerance, s.")]


IRREGULAR = {"axes": "axis", "pitches": "pitch"}  # fields of repeatable options


def option_of(field: str) -> str:
    """Return the option of a field."""
    return f"--{IRREGULAR.get(field, field)}"


def as_options(sentence: str) -> str:
    """Replace fields that a sentence names as YAML between backquotes, such as `step: 1e-4`, by options."""
    return re.sub(r"`(\w+: [^`]+)`", lambda field: _words(field[1]), sentence)


def _words(fields: str) -> str:
    import yaml

    try:
        content = yaml.safe_load(f"{{{fields}}}")
    except yaml.YAMLError:  # a name of a column that looks like fields
        return f"`{fields}`"
    words = []
    for name, value in content.items():
        for key, item in value.items() if isinstance(value, dict) else [("", value)]:
            text = f"{key}={item}" if key else str(item)
            words += [option_of(name)] if item is True else [option_of(name), shlex.quote(text)]
    return " ".join(words)
