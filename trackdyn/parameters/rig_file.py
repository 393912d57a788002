"""Files of rigs: shipped ones by name, what a file takes from another one (``like``), and its short way of writing.

With ``like`` a file states only what differs from another one; its ``wheels`` replace all of the other's. A value may
be text, ``radius: 0.305 m``, or a bare number without unit if its section says ``source`` (and ``kind``, else assumed)
once for all such values.
"""

import re
from collections.abc import Iterator
from math import nan, pi, tan
from os.path import exists, isfile
from pathlib import Path
from typing import Any

from trackdyn.errors import InputError, shown
from trackdyn.parameters.yaml_file import ENTRY_KEYS, KINDS, read_yaml

SHIPPED = Path(__file__).parents[1] / "rigs"
DEFAULT = "paper"
TRIED = "tried"  # steps that were tried on this rig, not on those that are like it
MOST_LIKE = 5  # files that take from one another
OUTLINE = "profile.outline"
WHEELS_OF_OLD = ("idler", "road_wheel")  # sections that are wheels of their own
NUMBER = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s+(\S(?:.*\S)?)\s*")
PLAIN_WORD = re.compile(r"[A-Za-z0-9_]{1,40}")
# what a wheel has if its file does not say so: aligned, and a bearing without loss
PLAIN_WHEEL = {
    name: {"value": 0.0, "unit": unit, "kind": "assumed", "source": "not stated in the file: aligned, no losses"}
    for name, unit in {
        "axial_offset": "m", "toe": "deg", "camber": "deg", "bearing_drag": "N m s/rad", "bearing_torque": "N m",
    }.items()
}  # fmt: skip


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
    """A single-pin chain's ``pitch`` as the equal-pitch radius of its sprocket, on which its pins make a polygon."""
    chain, sprocket = data.get("chain"), data.get("sprocket")
    if not isinstance(chain, dict) or "pitch" not in chain or not isinstance(sprocket, dict):
        return data
    from trackdyn.parameters.quantities import number_of

    entry, kind, *others = (
        of if isinstance(of := section.get(key), dict) else {}
        for section, key in ((chain, "pitch"), (chain, "kind"), (chain, "link_thickness"), (sprocket, "teeth"))
    )
    if kind.get("value") != "single_pin":
        raise InputError(
            f"{name}: chain.pitch is that of a single-pin chain; with two pins the pitch follows from "
            "chain.link_length and sprocket.equal_pitch_radius: state these, or kind: single_pin"
        )
    pitch, thickness, teeth = (number_of(of.get("value")) for of in (entry, *others))
    radius = pitch / (2 * tan(pi / teeth)) - thickness / 2 if teeth > 2 else nan
    if entry.get("unit") != "m" or not radius > 0:
        raise InputError(f"{name}: chain.pitch = {shown(entry.get('value'))}: must be a length in m, such as 0.17 m")
    source = f"{entry['source']}: {teeth:g} bodies of {pitch:g} m make the polygon of pins"
    follows = {"value": radius, "unit": "m", "kind": "derived", "source": source}
    sprocket = {"ring_radius": follows} | sprocket | {"equal_pitch_radius": follows}
    return data | {"chain": {key: of for key, of in chain.items() if key != "pitch"}, "sprocket": sprocket}


def _read(path: Path | str, depth: int) -> dict[str, Any]:
    data = read_yaml(path)
    path = Path(path)
    if not isinstance(data, dict):
        raise InputError(f"{path}: must hold sections, a mapping of names to values")
    like = data.get("like")
    try:
        data = {
            key: _written_out(content, str(key), {}, path.parent)
            for key, content in data.items()
            if key not in ("like", "about", TRIED)  # words of this file alone
        }
        copy_wheels = isinstance(data.get("wheels"), dict)
        if copy_wheels:
            wheels = {
                key: PLAIN_WHEEL | wheel if isinstance(wheel, dict) else wheel for key, wheel in data["wheels"].items()
            }
            data |= {key: wheels.pop(key) for key in WHEELS_OF_OLD if key in wheels and key not in data}
            data["wheels"] = wheels
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if like is None:
        return data
    if not isinstance(like, str) or not 0 < len(like) < 256:
        raise InputError(f"{path}: like = {shown(like)}: must be the name of a shipped rig or of a file")
    if depth == 0:
        raise InputError(f"{path}: like = {shown(like)}: leads from file to file without an end; name a complete rig")
    base = _read(_like(path, like), depth - 1)
    if copy_wheels:
        base = {key: content for key, content in base.items() if key not in ("wheels", *WHEELS_OF_OLD)}
    for section, other in (("groove", "profile"), ("profile", "groove")):
        if section in data:
            base.pop(other, None)
    stated = {
        key: set(content) if isinstance(content := data.get(key), dict) else set() for key in ("chain", "sprocket")
    }
    for field, section, other in (("pitch", "sprocket", "ring_radius"), ("equal_pitch_radius", "chain", "pitch")):
        if field in stated["chain"] | stated["sprocket"] and isinstance(base.get(section), dict):
            base[section] = {key: content for key, content in base[section].items() if key != other}
    if {"pitch", "equal_pitch_radius"} <= stated["chain"] | stated["sprocket"]:
        raise InputError(f"{path}: chain.pitch gives sprocket.equal_pitch_radius; leave one of them out")
    return base | {
        key: base[key] | content
        if isinstance(content, dict) and isinstance(base.get(key), dict) and key != "wheels" and "value" not in content
        else content
        for key, content in data.items()
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
    from trackdyn.parameters.outline import read_outline

    path = folder / content["value"]
    return content | {"value": read_outline(path), "source": f"{content['source']} ({path.name})"}
