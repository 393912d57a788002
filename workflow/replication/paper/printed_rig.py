"""A rig with what a reader of the article filled in (`paper_tables`): values, lengths, and Table 1 as its groove."""

import os
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from replication.paper.paper_tables import (
    AXIAL,
    FACTORS,
    LENGTHS,
    OWN,
    PaperTables,
    load_article,
    table1_arcs,
    value_of,
)
from trackdyn.errors import InputError, shown
from trackdyn.files import replacing
from trackdyn.parameters.groove import Groove, connector_length, equal_pitch_radius
from trackdyn.parameters.outline import TANGENT, ToothProfile, half_unit, rounding
from trackdyn.parameters.quantities import number_of
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import read_rig, rig_path, shipped_rigs


def write_printed_rig(out: Path, tables: Path | str, rig: Path | str) -> list[str]:
    """Write a rig file that is like another one but for the cells of the article.

    Parameters
    ----------
    out : path
        File to write.
    tables : path
        Cells (`paper_tables.PaperTables`).
    rig : path or str
        Rig whose values the cells replace: a file, or a shipped one.

    Returns
    -------
    list of str
        What lies outside the range of the value that it replaces, in sentences.

    Raises
    ------
    InputError
        One sentence with file, field, value and what is accepted; nothing is written.
    """
    cells = load_article(tables)
    load_rig(rig)
    written = out
    try:
        changes = printed_changes(read_rig(rig), cells, str(tables))
        like = str(rig) if str(rig) in shipped_rigs() else os.path.relpath(rig_path(rig), out.resolve().parent)
        text = yaml.safe_dump({"like": Path(like).as_posix()} | changes, sort_keys=False, width=120, allow_unicode=True)
        with replacing(out) as written:
            written.write_text(f"# made by trackdyn article from {tables}\n{text}", encoding="utf-8")
            load_rig(written)
    except InputError as error:
        raise InputError(f"{tables}: {str(error).removeprefix(f'{written}: ')}") from None
    outside = []
    for section, fields in changes.items():
        for field, entry in fields.items() if "value" not in fields else [("", fields)]:
            value, low, high = (number_of(entry.get(key)) for key in ("value", "low", "high"))
            if value < low or value > high:
                outside.append(
                    f"{'.'.join(filter(None, (section, field)))} = {value:g} {entry['unit']} is not within {low:g} to "
                    f"{high:g}, its range; is the cell in this unit?"
                )
    return outside


def _table1_groove(tables: PaperTables, teeth: int) -> list[list[float]] | None:
    """Arcs of Table 1, or None; refused if they give no groove, or one with other angles or another addendum."""
    arcs = table1_arcs(tables.table1)
    if arcs is None:
        return None
    try:
        groove, _ = ToothProfile(arcs=arcs).fitted(teeth)
    except InputError as error:
        raise InputError(
            str(error).replace("profile.arcs: arcs", "table1: areas").replace("profile.arcs", "table1")
        ) from None
    off = rounding(np.array(arcs))
    reaches = np.hypot(*np.diff(groove.centre[:5], axis=0).T)
    _refuse_angles(tables, groove, off / reaches.min())
    printed = value_of(tables, "r_a")
    if printed is not None and abs(printed - groove.addendum) > off + half_unit([printed]):
        raise InputError(
            f"parameters.r_a = {printed:g} m is not the addendum circle of Table 1, {groove.addendum:.6g} m: a table "
            "and a radius that agree, or one of them alone in Table 1, are accepted"
        )
    return arcs


def _refuse_angles(tables: PaperTables, groove: Groove, off: float) -> None:
    """Refuse directions and spread angles that are not those of the arcs; ``off`` (rad) is what rounding may do."""
    table = tables.table1
    for name, angles, scale in (
        ("u_x", groove.direction[:, 0], 1.0),
        ("u_y", groove.direction[:, 1], 1.0),
        ("theta", groove.half_angle, FACTORS[table.units.theta]),
    ):
        cells = {area: value for area, row in table.areas.items() if (value := getattr(row, name)) is not None}
        for area, value in cells.items():
            if abs(scale * value - angles[area - 1]) > off + scale * half_unit(cells.values()):
                raise InputError(
                    f"table1.areas.{area}.{name} = {value:g} is not what centres and radii give, "
                    f"{angles[area - 1] / scale:.5g}; cells that agree, or null, are accepted"
                )


def printed_changes(data: dict, tables: PaperTables, file: str) -> dict[str, Any]:
    """Sections of a rig file with the entries that cells change.

    ``data`` are sections of entries ``{value, unit, kind, source}``; sources name ``file``.
    """
    changes: dict[str, Any] = {}

    def put(name: str, value: Any, kind: str, source: str) -> None:
        section, _, field = name.partition(".")
        before = data[section].get(field, {}) if field else data[section]
        entry = {key: before[key] for key in ("low", "high", "unit") if key in before}
        entry |= {"value": value, "kind": kind, "source": source}
        if field:
            changes.setdefault(section, {})[field] = entry
        else:
            changes[section] = entry

    known = [f"{key}.{field}" for key, entries in data.items() if isinstance(entries, dict) for field in entries]
    for name, entry in tables.parameters.items():
        if name in OWN or entry.value is None:
            continue  # the rig may be another one, without that parameter
        if name not in known:
            near = get_close_matches(name, [*known, *OWN], 1)
            meant = f"did you mean {near[0]!r}?" if near else "a name such as chain.link_mass is accepted"
            raise InputError(f"parameters.{shown(name)} is not a parameter of this rig; {meant}")
        section, field = name.split(".")
        unit = data[section][field].get("unit")
        if unit != entry.unit:
            raise InputError(f"parameters.{name} has the unit {shown(entry.unit)}; it must be given in {unit!r}")
        put(name, entry.value, "printed", f"{entry.place}; a cell of {file}")

    def number(name: str) -> float:
        section, field = name.split(".")
        return number_of((changes.get(section, {}).get(field) or data[section][field]).get("value"))

    thick, thin = (
        sorted((value_of(tables, name) for name in AXIAL), reverse=True) if value_of(tables, "t_S") else (0, 0)
    )
    if thick:
        put("tooth_contact.contact_length", thin, "derived", f"the smaller one of t_S and t_C, Eq. 19; cells of {file}")
        put("tooth_contact.axial_overhang", (thick - thin) / 2, "derived", f"(t_S - t_C) / 2, Eq. 19; cells of {file}")
    teeth = number("sprocket.teeth")
    thickness = number("chain.link_thickness")
    if (lengths := _lengths(tables, int(teeth), number("chain.link_length"))) is not None:
        link, connector = lengths
        if value_of(tables, "chain.link_length") is None and link != number("chain.link_length"):
            put("chain.link_length", link, "derived", f"from L_C and pitch or pitch circle; cells of {file}")
        radius = equal_pitch_radius(int(teeth), link, connector, thickness)["polygonal"]
        source = (
            f"polygonal, from link {link:.6g} m and connector {connector:.6g} m by cells of {file}; printed 0.308 m"
        )
        put("sprocket.equal_pitch_radius", radius, "derived", source)
    arcs = _table1_groove(tables, int(teeth))
    if arcs is not None:
        source = f"{tables.table1.place}; cells of {file}"
        changes["profile"] = {"arcs": {"value": arcs, "unit": "m, m, m, 1", "kind": "printed", "source": source}}
    return changes


def _lengths(tables: PaperTables, teeth: int, assumed: float) -> tuple[float, float] | None:
    """Pin to pin lengths (m) of link and connector, or None if no cell tells the connector's.

    The link's length is ``assumed`` if the cells do not tell it either.
    """
    link, connector, pitch, circle = (value_of(tables, name) for name in LENGTHS)
    if connector is None and pitch is None and circle is None:
        return None
    if link is None:
        if connector is not None and pitch is not None:
            link = pitch - connector
        elif connector is not None and circle is not None:
            link = connector_length(teeth, connector, circle)
        else:
            link = assumed
    if connector is None:
        connector = pitch - link if pitch is not None else connector_length(teeth, link, circle)
    if not (link > 0 and connector > 0):
        name, value = ("pitch", pitch) if pitch is not None else ("L_C", connector)
        raise InputError(
            f"parameters.{name} = {value:g} m leaves no length for link ({link:.6g} m) and connector "
            f"({connector:.6g} m); a longer pitch is accepted"
        )
    cells = [value for name in LENGTHS if (value := value_of(tables, name)) is not None]
    off = TANGENT + 3 * half_unit(cells)
    if pitch is not None and abs(pitch - link - connector) > off:
        raise InputError(
            f"parameters.pitch = {pitch:g} m is not link and connector, {link:.6g} + {connector:.6g} m; three lengths "
            "that agree, or two of them, are accepted"
        )
    if circle is not None and abs(connector_length(teeth, link, circle) - connector) > off:
        raise InputError(
            f"parameters.r_p = {circle:g} m is not the circle on which {teeth} pitches of {link:.6g} + {connector:.6g}"
            f" m close, which asks for a connector of {connector_length(teeth, link, circle):.6g} m; lengths that "
            "agree, or one of them less, are accepted"
        )
    return link, connector
