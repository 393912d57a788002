"""Rig files: included ones by name, inheritance from another file (``like``), and the short form of entries.

With ``like`` a file overrides values of another file; ``wheels`` and ``sensors`` replace those of the other file,
``idler``, ``road_wheel`` and ``sensor`` override values of the wheel or sensor of that name, or add it. A value may be
text, ``radius: 0.305 m``, or a number without unit if its section has ``source`` (and ``kind``, else assumed).
"""

import re
from math import nan
from os.path import exists, isfile, realpath
from pathlib import Path
from typing import Any

from trackdyn.inputs.errors import InputError, naming, shown
from trackdyn.inputs.yaml_file import ENTRY_KEYS, KINDS, RANGE_KEYS, read_yaml

SHIPPED = Path(__file__).parents[1] / "rigs"
DEFAULT = "paper"
TRIED = "tried"  # steps that were tried on this rig
OWN = ("like", "about", TRIED)  # keys that are not inherited
LONGEST_PITCH = 4  # lengths of a link
LARGEST_SIZE = 1000.0  # pitch and sprocket, m, and number of teeth
OTHER_CHAIN = {"kind", "link_length", "teeth"}  # a file with one of them describes another chain, not a worn one
# sections that stand for a wheel or a sensor of that name, by the group that has it
MEMBERS = {"idler": "wheels", "road_wheel": "wheels", "sensor": "sensors"}
GROUPS = ("wheels", "sensors")
QUANTITY = re.compile(r"\s*([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s+(\S(?:.*\S)?)\s*")
PLAIN_WORD = re.compile(r"[A-Za-z0-9_]{1,40}")
# fields of a wheel that a law of drag reads
DRAG_FIELDS = {"viscous": ("bearing_drag",), "coulomb": ("bearing_torque",), "rolling": ("rolling_arm", "seal_drag")}


def shipped_rigs() -> dict[str, Path]:
    """Return the files of the included rigs by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.yaml"))}


def rig_path(name: Path | str) -> Path | str:
    """Return the file of a rig, by its path or by the name of an included one if no file has it; or `InputError`."""
    shipped = shipped_rigs()
    if not isinstance(name, str) or not PLAIN_WORD.fullmatch(name) or isfile(name):
        return name
    if name not in shipped and not exists(name):  # a folder is refused as such
        remedy = f"these are {', '.join(shipped)}, see trackdyn rigs"
        raise InputError(f"rig = {shown(name)}: no such file, and no included rig of that name; {remedy}")
    return shipped.get(name, name)


def read_rig(name: Path | str) -> dict[str, Any]:
    """Return the contents of a rig file, with inherited ones and every entry written out; or `InputError`."""
    rig: dict[str, Any] = {}
    for path, content in reversed(_files(name)):
        with naming(path):
            pull = {"load": _pull(content["load"])} if isinstance(content.get("load"), str) else {}
            own = {key: _written_out(value, str(key), {}) for key, value in (content | pull).items() if key not in OWN}
            rig = _over(rig, own)
    with naming(name):
        return _with_pitch(rig)


def _pull(text: str) -> dict[str, Any]:
    """Return the entry of a load that is text, such as ``3 kN`` or ``3kN``: a condition of runs needs no source."""
    match = QUANTITY.fullmatch(re.sub(r"(?<=[0-9.])(?=k?N\s*$)", " ", text))
    if match:
        text = f"{1e3 * float(match[1])!r} N" if match[2] == "kN" else f"{match[1]} {match[2]}"
    return _written_out(text, "load", {"source": "a pull that this file states"})


def _files(name: Path | str) -> list[tuple[Path, dict[str, Any]]]:
    """Return the files of a rig with their contents: its own, then those it inherits from by ``like`` in turn."""
    files: list[tuple[Path, dict[str, Any]]] = []
    path, like = rig_path(name), None
    while like is not None or not files:
        data = read_yaml(path)
        path = Path(path)
        if not isinstance(data, dict):
            raise InputError(f"{path}: must hold sections, a mapping of names to values")
        files.append((path, data))
        if (like := data.get("like")) is not None:
            if not isinstance(like, str) or not 0 < len(like) < 256 or "\0" in like:
                raise InputError(f"{path}: like = {shown(like)}: must be the name of an included rig or of a file")
            named = Path(path.parent / like if isfile(path.parent / like) else rig_path(like))
            if realpath(named) in [realpath(other) for other, _ in files]:
                endless = "leads from file to file without an end; name a complete rig"
                raise InputError(f"{path}: like = {shown(like)}: {endless}")
            path = named
    return files


def rig_files(name: Path | str) -> list[Path]:
    """Return the files that a valid rig is read from: its own, and those it inherits from."""
    return [path for path, _ in _files(name)]


def groove_origin(name: Path | str) -> Path | None:
    """Return the file from which a rig inherits its groove or profile, None if it does not."""
    files = _files(name)
    origin = next((path for path, data in files if data.keys() & {"groove", "profile"}), files[-1][0])
    return None if origin == files[0][0] else origin


def _section(data: dict, name: str) -> dict[str, Any]:
    """Return a section of a rig file, or an entry; empty if it is none."""
    section = data.get(name)
    return section if isinstance(section, dict) else {}


def _over(base: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
    """Return the rig ``base`` with the values of ``data`` in place of its own."""
    own, inherited = ({**_section(rig, "chain"), **_section(rig, "sprocket")} for rig in (data, base))
    other_chain, own_wheels = bool(own.keys() & OTHER_CHAIN), _section(data, "wheels")
    if own.keys() >= {"pitch", "equal_pitch_radius"}:
        raise InputError("chain.pitch gives sprocket.equal_pitch_radius; leave one of them out")
    dropped: set[str] = set()  # inherited fields of chain and sprocket that contradict those of the file
    if "equal_pitch_radius" in own:
        dropped = {"pitch"}
    elif "pitch" in own and other_chain:
        dropped = {"ring_radius", "equal_pitch_radius"}
    elif "pitch" in own | inherited and "groove" in data:  # a groove that is designed for this pitch
        dropped = {"equal_pitch_radius"}
    rig = dict(base)
    for name in ("chain", "sprocket"):
        if isinstance(rig.get(name), dict):
            rig[name] = {key: entry for key, entry in rig[name].items() if key not in dropped}
    for name, other in (("groove", "profile"), ("profile", "groove")):
        if name in data:
            rig.pop(other, None)
    own_fields = {field for name in own_wheels for field in _section(own_wheels, name)}
    laws = [law for law, fields in DRAG_FIELDS.items() if own_fields.intersection(fields)]
    if len(laws) == 1:
        source = "the one law that the values of the wheels are for"
        data = {"drag": {"value": laws[0], "unit": "name", "kind": "assumed", "source": source}} | data

    def merged(content: Any, old: Any) -> Any:
        if not isinstance(content, dict) or not isinstance(old, dict) or "value" in content:
            return content
        return old | {key: with_range(entry, _section(old, key)) for key, entry in content.items()}

    def with_range(entry: Any, old: dict[str, Any]) -> Any:
        """Return the entry with the range of the value that it replaces, if it has none and the range holds here."""
        unit = old.get("unit")
        # ranges of sizes hold for one chain, of materials (friction, restitution, slip) for all, of angles for wheels
        foreign = (other_chain and unit not in ("1", "m/s")) or (own_wheels and unit == "deg")
        if not isinstance(entry, dict) or foreign or not old or entry.get("unit") != unit or "value" not in entry:
            return entry
        return entry if entry.keys() & RANGE_KEYS else {key: old[key] for key in RANGE_KEYS if key in old} | entry

    rig |= {name: data[name] for name in GROUPS if name in data}
    for name, content in data.items():
        group = MEMBERS.get(name, "")
        if group and isinstance(members := rig.setdefault(group, {}), dict):
            rig[group] = members | {name: merged(content, members.get(name))}
        elif name not in GROUPS:
            rig[name] = merged(content, rig.get(name))
    return rig


def _with_pitch(rig: dict[str, Any]) -> dict[str, Any]:
    """Convert a chain's ``pitch`` to the equal-pitch radius of its sprocket, on which its pins make a polygon.

    A groove that was designed for another radius stays where it is: its seat is deeper below the pins of a worn chain.
    """
    chain, sprocket, groove = (dict(_section(rig, name)) for name in ("chain", "sprocket", "groove"))
    if "pitch" not in chain or not sprocket:
        return rig
    from trackdyn.inputs.quantities import entry_value, number_of
    from trackdyn.rig.groove import equal_pitch_radii, pin_height

    def number(section: dict, key: str) -> float:
        return number_of(_section(section, key).get("value", nan))

    length, thickness, teeth = number(chain, "link_length"), number(chain, "link_thickness"), number(sprocket, "teeth")
    entry, radius = chain.pop("pitch"), nan
    try:
        pitch = number_of(entry_value(entry, "m"))
    except ValueError as error:
        raise InputError(f"chain.pitch {error}") from None
    if _section(chain, "kind").get("value") == "single_pin":
        accepted, body, possible = "a length in m, such as 0.17 m", pitch, pitch > 0
    else:
        accepted = f"in m, more than chain.link_length = {length:g} m and less than {LONGEST_PITCH} times as much"
        body, possible = length, length < pitch < LONGEST_PITCH * length
    if not 2 < teeth < LARGEST_SIZE:
        return rig | {"chain": chain}  # refused with the sprocket
    if possible and pitch < LARGEST_SIZE:
        radius = equal_pitch_radii(teeth, body, pitch - body, thickness)["polygon"]
    if not 0 < radius < LARGEST_SIZE:
        raise InputError(f"chain.pitch = {shown(entry['value'])}: must be {accepted}")

    def derived(value: float, source: str) -> dict[str, Any]:
        return {"value": value, "unit": "m", "kind": "derived", "source": source}

    equal = derived(radius, f"{entry['source']}: {teeth:g} pitches of {pitch:g} m fill the polygon of pins")
    seat, designed_for = _section(groove, "seat_depth"), number(sprocket, "equal_pitch_radius")
    if seat.keys() >= ENTRY_KEYS and 0 < designed_for < LARGEST_SIZE:
        new, old = (pin_height(int(teeth), length, thickness, equal) for equal in (radius, designed_for))
        source = f"{seat['source']}; the pins of this pitch stand {1e3 * (new - old):.3g} mm higher"
        groove["seat_depth"] = derived(number(groove, "seat_depth") + new - old, source)
        rig = rig | {"groove": groove}
    return rig | {"chain": chain, "sprocket": {"ring_radius": equal} | sprocket | {"equal_pitch_radius": equal}}


def _written_out(content: Any, name: str, about: dict[str, str]) -> Any:
    """Return a section, or an entry, with its short forms written out; ``about`` is its kind and source."""
    if isinstance(content, dict) and not content.keys() & {"value", "unit"}:
        own = {"source"} if isinstance(content.get("source", 0), str | None) else set()
        # kind may be one of the section's values (``chain.kind``)
        own |= {"kind"} if content.get("kind", 0) in (*KINDS, None) else set()
        about = about | {key: content[key] for key in own if content[key] is not None}
        return {key: _written_out(value, f"{name}.{key}", about) for key, value in content.items() if key not in own}
    match = QUANTITY.fullmatch(content) if isinstance(content, str) else None
    if match and not about.get("source"):
        remedy = "write source: in its section, or value, unit, kind and source"
        raise InputError(f"{name} = {shown(content)} has no source; {remedy}")
    if about.get("source") and isinstance(content, (str, int, float)) and not isinstance(content, bool):
        value, unit = content, "name" if isinstance(content, str) else "1"
        if match:
            value, unit = float(match[1]), match[2]
            value = int(value) if value.is_integer() and match[1].lstrip("+-").isdigit() else value
        content = {"value": value, "unit": unit, "kind": "assumed"} | about
    return content
