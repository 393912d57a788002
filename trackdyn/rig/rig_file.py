"""Files of rigs: shipped ones by name, what a file takes from another one (``like``), and its short way of writing.

With ``like`` a file overrides single values of another file; ``wheels`` and ``sensors`` replace those of the other
file. The sections ``idler``, ``road_wheel`` and ``sensor`` override single values of the wheel or sensor of that name,
or add it. A value may be text, ``radius: 0.305 m``, or a bare number without unit if its section says ``source`` (and
``kind``, else assumed) once for all such values.
"""

import re
from collections.abc import Iterator
from math import nan, pi, tan
from os.path import exists, isfile
from pathlib import Path
from typing import Any

from trackdyn.errors import InputError, shown
from trackdyn.rig.yaml_file import ENTRY_KEYS, KINDS, read_yaml

SHIPPED = Path(__file__).parents[1] / "rigs"
DEFAULT = "paper"
TRIED = "tried"  # steps that were tried on this rig, not on those that are like it
LONGEST_PITCH = 4  # lengths of a link
MOST_LIKE = 5  # files that take from one another
OUTLINE = "profile.outline"
OTHER_CHAIN = {"kind", "link_length", "teeth"}  # a file with one of them describes another chain, not a worn one
# sections that stand for a wheel or a sensor of that name, by the group that has it
MEMBERS = {"idler": "wheels", "road_wheel": "wheels", "sensor": "sensors"}
GROUPS = ("wheels", "sensors")
NUMBER = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s+(\S(?:.*\S)?)\s*")
PLAIN_WORD = re.compile(r"[A-Za-z0-9_]{1,40}")
# fields of a wheel that a law of drag reads
DRAG_FIELDS = {"viscous": ("bearing_drag",), "coulomb": ("bearing_torque",), "rolling": ("rolling_arm", "seal_drag")}


def shipped_rigs() -> dict[str, Path]:
    """Files of the rigs in the package by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.yaml"))}


def rig_path(name: Path | str) -> Path | str:
    """The file of a rig, given by its path or the name of a shipped one; `InputError` if a word is neither."""
    if not isinstance(name, str) or not PLAIN_WORD.fullmatch(name) or exists(name):
        return name
    shipped = shipped_rigs()
    if name not in shipped:
        raise InputError(
            f"rig = {shown(name)}: no such file, and no shipped rig of that name; the shipped "
            f"ones are {', '.join(shipped)}, see trackdyn rigs"
        )
    return shipped[name]


def read_rig(name: Path | str) -> dict[str, Any]:
    """Contents of a rig file with all that it takes from others, every entry written out; or `InputError`."""
    return _with_pitch(_read(rig_path(name), MOST_LIKE), name)


def _chain(name: Path | str) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Every file that a rig is read from, each with its contents: its own, then the one that it is like, and so on."""
    path: Path | str | None = rig_path(name)
    while path is not None:
        data = read_yaml(path)
        yield Path(path), data
        path = _like(Path(path), data["like"]) if "like" in data else None


def _like(path: Path, like: str) -> Path | str:
    """The file that ``like`` names in the file ``path``: one beside it, or a shipped rig."""
    sibling = path.parent / like
    return sibling if isfile(sibling) else rig_path(like)


def rig_files(name: Path | str) -> list[Path]:
    """List the files that a valid rig is read from: its own, those that it is like, and those of its outlines."""
    files = []
    for path, data in _chain(name):
        outline = data.get("profile", {}).get("outline")
        outline = outline.get("value") if isinstance(outline, dict) else outline
        files += [path, *([path.parent / outline] if isinstance(outline, str) else [])]
    return files


def groove_origin(name: Path | str) -> Path | None:
    """The file that a rig takes its groove or profile from; None: it states its own, or takes from none."""
    files = list(_chain(name))
    origin = next((path for path, data in files if data.keys() & {"groove", "profile"}), files[-1][0])
    return None if origin == files[0][0] else origin


def _with_pitch(data: dict, name: Path | str) -> dict:
    """A chain's ``pitch`` as the equal-pitch radius of its sprocket, on which its pins make a polygon.

    A groove that was designed for another radius stays where it is: its seat is deeper below the pins of a worn chain.
    Raises `InputError`: no sprocket has this pitch.
    """
    chain, sprocket = data.get("chain"), data.get("sprocket")
    if not isinstance(chain, dict) or "pitch" not in chain or not isinstance(sprocket, dict):
        return data
    from trackdyn.rig.groove import equal_pitch_radius, pin_height
    from trackdyn.rig.quantities import number_of

    def number(section: dict, key: str) -> float:
        entry = section.get(key)
        return number_of(entry.get("value")) if isinstance(entry, dict) else nan

    entry = chain["pitch"] if isinstance(chain["pitch"], dict) else {}
    pitch, length, thickness = (number(chain, key) for key in ("pitch", "link_length", "link_thickness"))
    teeth, kind = number(sprocket, "teeth"), chain.get("kind")
    if isinstance(kind, dict) and kind.get("value") == "single_pin":
        radius = pitch / (2 * tan(pi / teeth)) - thickness / 2 if teeth > 2 else nan
        accepted = "a length in m, such as 0.17 m"
    else:
        possible = teeth > 2 and length < pitch < LONGEST_PITCH * length
        radius = equal_pitch_radius(int(teeth), length, pitch - length, thickness)["polygonal"] if possible else nan
        accepted = f"in m, more than chain.link_length = {length:g} m and less than {LONGEST_PITCH} times as much"
    if entry.get("unit") != "m" or not radius > 0:
        raise InputError(f"{name}: chain.pitch = {shown(entry.get('value'))}: must be {accepted}")
    source = f"{entry['source']}: {teeth:g} pitches of {pitch:g} m fill the polygon of pins"
    derived = {"value": radius, "unit": "m", "kind": "derived", "source": source}
    groove, designed_for = data.get("groove"), number(sprocket, "equal_pitch_radius")
    if isinstance(groove, dict) and isinstance(groove.get("seat_depth"), dict) and designed_for == designed_for:
        seat = groove["seat_depth"]
        rise, base = (pin_height(int(teeth), length, thickness, equal) for equal in (radius, designed_for))
        rise -= base
        deeper = {"value": number_of(seat["value"]) + rise, "unit": "m", "kind": "derived"}
        deeper["source"] = f"{seat['source']}; the pins of this pitch stand {1e3 * rise:.3g} mm higher"
        data = data | {"groove": groove | {"seat_depth": deeper}}
    chain = {key: value for key, value in chain.items() if key != "pitch"}
    return data | {"chain": chain, "sprocket": {"ring_radius": derived} | sprocket | {"equal_pitch_radius": derived}}


def _read(path: Path | str, depth: int) -> dict[str, Any]:
    """Contents of a file over those of the file that it is like, at most ``depth`` files away."""
    data = read_yaml(path)
    path = Path(path)
    if not isinstance(data, dict):
        raise InputError(f"{path}: must hold sections, a mapping of names to values")
    base = {}
    if (like := data.get("like")) is not None:
        if not isinstance(like, str) or not 0 < len(like) < 256:
            raise InputError(f"{path}: like = {shown(like)}: must be the name of a shipped rig or of a file")
        if depth == 0:
            raise InputError(
                f"{path}: like = {shown(like)}: leads from file to file without an end; name a complete rig"
            )
        base = _read(_like(path, like), depth - 1)
    try:
        data = {
            key: _written_out(content, str(key), {}, path.parent)
            for key, content in data.items()
            if key not in ("like", "about", TRIED)  # words of this file alone
        }
        return _over(base, data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _over(base: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
    """The rig ``base`` with the values of ``data`` in place of its own."""
    dropped, other_chain = _pitch_rules(base, data)
    merged = {key: content for key, content in base.items() if key not in dropped}
    for key in ("chain", "sprocket"):
        if isinstance(base.get(key), dict):
            merged[key] = {field: content for field, content in base[key].items() if field not in dropped}
    own_wheels = isinstance(data.get("wheels"), dict)
    if own_wheels:
        data = _drag_of_wheels(data["wheels"]) | data
    merged |= {key: data[key] for key in GROUPS if key in data}

    def section(content: Any, old: Any) -> Any:
        if not isinstance(content, dict) or not isinstance(old, dict) or "value" in content:
            return content
        return old | _with_ranges(content, old, other_chain, own_wheels)

    for key, content in data.items():
        if key in MEMBERS:
            members = merged.setdefault(MEMBERS[key], {})
            if isinstance(members, dict):
                merged[MEMBERS[key]] = members | {key: section(content, members.get(key))}
        elif key not in GROUPS:
            merged[key] = section(content, merged.get(key))
    return merged


def _pitch_rules(base: dict[str, Any], data: dict[str, Any]) -> tuple[set[str], bool]:
    """Sections and fields of ``base`` that do not hold beside those of ``data``, and whether this is another chain."""
    dropped = {other for section, other in (("groove", "profile"), ("profile", "groove")) if section in data}
    stated, known = (
        {field for key in ("chain", "sprocket") if isinstance(rig.get(key), dict) for field in rig[key]}
        for rig in (data, base)
    )
    other_chain = bool(stated & OTHER_CHAIN)
    if {"pitch", "equal_pitch_radius"} <= stated:
        raise InputError("chain.pitch gives sprocket.equal_pitch_radius; leave one of them out")
    if "equal_pitch_radius" in stated:
        dropped.add("pitch")
    elif "pitch" in stated and other_chain:
        dropped |= {"ring_radius", "equal_pitch_radius"}
    elif "pitch" in stated | known and "groove" in data:  # a groove that is designed for this pitch
        dropped.add("equal_pitch_radius")
    return dropped, other_chain


def _drag_of_wheels(wheels: dict) -> dict[str, Any]:
    """Law of drag for which a file's own wheels have values, if there is one alone."""
    stated = {field for wheel in wheels.values() if isinstance(wheel, dict) for field in wheel}
    laws = [law for law, fields in DRAG_FIELDS.items() if stated.intersection(fields)]
    source = "the one law that the values of the wheels are for"
    return {"drag": {"value": laws[0], "unit": "name", "kind": "assumed", "source": source}} if len(laws) == 1 else {}


def _with_ranges(section: dict, base: dict, other_chain: bool, other_wheels: bool) -> dict:
    """A section whose values without a range have that of the values they replace, where it holds for them.

    Ranges of sizes hold for one chain, those of materials (friction, restitution, slip) for every one; a direction
    belongs to the wheels.
    """

    def holds(entry: Any, old: Any) -> bool:
        if not all(isinstance(item, dict) and "value" in item for item in (entry, old)):
            return False
        if "low" in entry or "high" in entry:
            return False
        unit = old.get("unit")
        size, angle = unit not in ("1", "m/s"), unit == "deg"
        return entry.get("unit") == unit and not (other_chain and size) and not (other_wheels and angle)

    return {
        key: {end: old[end] for end in ("low", "high") if end in old} | entry
        if holds(entry, old := base.get(key, {}))
        else entry
        for key, entry in section.items()
    }


def _written_out(content: Any, name: str, about: dict, folder: Path) -> Any:
    """A section, or an entry, with the entries of its short form written out."""
    if isinstance(content, str):
        content = _entry(content, name, about)
        return _with_points(content, name, folder)
    if isinstance(content, (int, float)) and not isinstance(content, bool) and about.get("source"):
        return {"value": content, "unit": "1", "kind": about.get("kind", "assumed"), "source": about["source"]}
    if not isinstance(content, dict) or content.keys() & {"value", "unit"}:
        return _with_points(content, name, folder)
    about = about | {
        key: content[key]
        for key in ("kind", "source")
        # kind may be one of the section's values (`drive.kind`)
        if isinstance(content.get(key), str) and (key == "source" or content["kind"] in KINDS)
    }
    return {
        key: _written_out(value, f"{name}.{key}", about, folder)
        for key, value in content.items()
        if not (key in ("kind", "source") and about.get(key) is content[key])
    }


def _entry(text: str, name: str, about: dict) -> Any:
    """An entry written as a number with its unit, or as a word, with kind and source of its section."""
    match = NUMBER.fullmatch(text)
    if not about.get("source"):
        if match is None:
            return text  # nothing of the short form: refused where the entry is read
        raise InputError(
            f"{name} = {shown(text)} has no source; write source: in its section, or value, unit, kind and source"
        )
    value, unit = (float(match[1]), match[2]) if match else (text, "m, m" if name == OUTLINE else "name")
    if match and float(value).is_integer() and "." not in match[1] and "e" not in match[1].lower():
        value = int(match[1])
    return {"value": value, "unit": unit, "kind": about.get("kind", "assumed"), "source": about["source"]}


def _with_points(content: Any, name: str, folder: Path) -> Any:
    """An entry whose value is the name of a CSV file of points gets the points: a rig holds all that it is made of."""
    entry = isinstance(content, dict) and content.keys() >= ENTRY_KEYS
    if not (entry and name == OUTLINE and isinstance(content["value"], str)):
        return content
    from trackdyn.rig.outline import read_outline

    path = folder / content["value"]
    return content | {"value": read_outline(path), "source": f"{content['source']} ({path.name})"}
