"""A rig with what a reader of the article filled in (`paper_tables`): values, lengths, and Table 1 as its groove."""

import os
from decimal import Decimal
from difflib import get_close_matches
from math import hypot, pi
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from replication.paper.paper_tables import Area, PaperTables, Table1, load_article
from trackdyn.errors import InputError, shown
from trackdyn.files import replacing
from trackdyn.rig.groove import CONVEX, connector_length, equal_pitch_radius
from trackdyn.rig.outline import TANGENT, ToothProfile, half_unit, rounding
from trackdyn.rig.quantities import entries_of, number_of
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import read_rig, rig_path, shipped_rigs

SIGNS = np.array([1.0 if area in CONVEX else -1.0 for area in range(1, 6)])
FLANKS = {"arcs": range(1, 6), "right": range(10, 5, -1)}  # areas by field of `ToothProfile`, tip first
LENGTHS = ("chain.link_length", "L_C", "pitch", "r_p")  # of which two give all
AXIAL = ("t_S", "t_C")
OWN = ("r_a", "r_p", "L_C", "pitch", *AXIAL)  # what the article names and a rig has no field for
LONGEST_M = 1000.0  # m, as of every length of a rig


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
    for name, entry in entries_of(changes).items():
        value, low, high = (number_of(entry.get(key)) for key in ("value", "low", "high"))
        if value < low or value > high:
            outside.append(
                f"{name} = {value:g} {entry['unit']} is not within {low:g} to {high:g}, its range; is the cell in this "
                "unit?"
            )
    return outside


def _flank(table: Table1, areas: range) -> list[list[float]]:
    """Rows of `ToothProfile.arcs` (m) of a flank, the right one mirrored; empty if no cell of it is filled in."""
    units = {"O_x": table.units.O, "O_y": table.units.O, "r": table.units.r}
    cells = {(area, key): getattr(table.areas.get(area, Area()), key) for area in areas for key in units}
    lacking = [cell for cell, value in cells.items() if value is None]
    if len(lacking) == len(cells):
        return []
    if lacking:
        area, key = min(lacking)
        raise InputError(
            f"table1.areas.{area}.{key} = null beside cells that are filled in: give O_x, O_y and r of areas 1 to 5, "
            "of areas 6 to 10 or of all; u_x, u_y and theta may stay null"
        )
    # a length in m with the decimals that it is printed with
    metres = [float(Decimal(repr(value)).scaleb({"m": 0, "mm": -3}[units[key]])) for (_, key), value in cells.items()]
    arcs = np.column_stack([np.reshape(metres, (-1, 3)), SIGNS])
    arcs[:, 0] *= 1.0 if areas[0] == 1 else -1.0
    return arcs.tolist()


def _table1_profile(tables: PaperTables, teeth: int) -> dict[str, list]:
    """Flanks of Table 1 by field of `ToothProfile`; refused if they give no groove, or one unlike other cells."""
    table = tables.table1
    profile = {field: arcs for field, areas in FLANKS.items() if (arcs := _flank(table, areas))}
    addendum = tables.value("r_a")
    if not profile:
        if addendum is not None or any(row.model_dump(exclude_none=True) for row in table.areas.values()):
            raise InputError(
                "parameters.r_a, u_x, u_y or theta is given without Table 1: they are compared with the groove that "
                "follows from O_x, O_y and r; fill these in, or use null"
            )
        return {}
    for field, arcs in profile.items():
        try:
            ToothProfile(arcs=arcs).groove(teeth)
        except InputError as error:
            areas = f"table1: areas {FLANKS[field][0]} to {FLANKS[field][-1]}"
            raise InputError(str(error).replace("profile.arcs", areas)) from None
    profile = profile if "arcs" in profile else {"arcs": profile["right"]}  # one flank mirrors the other one
    groove = ToothProfile(**profile).groove(teeth)
    off = max(rounding(np.array(arcs)) for arcs in profile.values())
    angle = pi / 180 if table.units.theta == "deg" else 1.0
    turned = off / np.hypot(*np.diff(groove.centre[:5], axis=0).T).min()  # rad, by rounding
    compared = [("u_x", groove.direction[:, 0], 1.0), ("u_y", groove.direction[:, 1], 1.0)]
    for name, angles, scale in (*compared, ("theta", groove.half_angle, angle)):
        cells = {area: value for area, row in table.areas.items() if (value := getattr(row, name)) is not None}
        for area, value in cells.items():
            if abs(scale * value - angles[area - 1]) > turned + scale * half_unit(cells.values()):
                raise InputError(
                    f"table1.areas.{area}.{name} = {value:g} is not what centres and radii give, "
                    f"{angles[area - 1] / scale:.5g}; cells that agree, or null, are accepted"
                )
    if addendum is not None and abs(addendum - groove.addendum) > off + half_unit([addendum]):
        raise InputError(
            f"parameters.r_a = {addendum:g} m is not the addendum circle of Table 1, {groove.addendum:.6g} m: a table "
            "and a radius that agree, or one of them alone in Table 1, are accepted"
        )
    return profile


def _check_own(tables: PaperTables) -> None:
    """Refuse a length outside the rig's fields that is none, and one axial length without the other."""
    for name in OWN:
        if (value := tables.value(name)) is None:
            continue
        unit = tables.parameters[name].unit
        if unit != "m" or isinstance(value, str) or not 0 < value <= LONGEST_M:
            raise InputError(
                f"parameters.{name} = {shown(value)} {unit}: must be a number between 0 and {LONGEST_M:g} m"
            )
    for name, other in (AXIAL, AXIAL[::-1]):
        if tables.value(name) is not None and tables.value(other) is None:
            raise InputError(
                f"parameters.{other} = null but {name} is given: give both lengths, whose mean is L of Eq. 19, or none"
            )


def printed_changes(data: dict, tables: PaperTables, file: str) -> dict[str, Any]:
    """Sections of a rig file with the entries that cells change.

    ``data`` are sections of entries ``{value, unit, kind, source}``; sources name ``file``.
    """
    _check_own(tables)
    changes: dict[str, Any] = {}
    known = {f"{key}.{field}": of for key, section in data.items() for field, of in section.items()}

    def put(name: str, value: Any, source: str, kind: str = "derived") -> None:
        section, field = name.split(".")
        entry = {key: of for key, of in known.get(name, {}).items() if key in ("low", "high", "unit")}
        changes.setdefault(section, {})[field] = entry | {"value": value, "kind": kind, "source": source}

    def number(name: str) -> float:
        section, field = name.split(".")
        return number_of(changes.get(section, {}).get(field, known[name]).get("value"))

    for name, entry in tables.parameters.items():
        if name in OWN or entry.value is None:
            continue  # the rig may be another one, without that parameter
        if not isinstance(known.get(name), dict):
            near = get_close_matches(name, [*known, *OWN], 1)
            meant = f"did you mean {near[0]!r}?" if near else "a name such as chain.link_mass is accepted"
            raise InputError(f"parameters.{shown(name)} is not a parameter of this rig; {meant}")
        unit = known[name].get("unit")
        if unit != entry.unit:
            raise InputError(f"parameters.{name} has the unit {shown(entry.unit)}; it must be given in {unit!r}")
        put(name, entry.value, f"{entry.place}; a cell of {file}", "printed")
    if tables.value("t_S"):
        thin, thick = sorted(tables.value(name) for name in AXIAL)
        put("tooth_contact.contact_length", thin, f"the smaller one of t_S and t_C, Eq. 19; cells of {file}")
        put("tooth_contact.axial_overhang", (thick - thin) / 2, f"(t_S - t_C) / 2, Eq. 19; cells of {file}")
    teeth = int(number("sprocket.teeth"))
    if any(tables.value(name) is not None for name in LENGTHS[1:]):
        link, connector = _lengths(tables, teeth, number("chain.link_length"))
        if tables.value("chain.link_length") is None and link != number("chain.link_length"):
            put("chain.link_length", link, f"from L_C and pitch or pitch circle; cells of {file}")
        radius = equal_pitch_radius(teeth, link, connector, number("chain.link_thickness"))["polygonal"]
        source = (
            f"polygonal, from link {link:.6g} m and connector {connector:.6g} m by cells of {file}; printed 0.308 m"
        )
        put("sprocket.equal_pitch_radius", radius, source)
    for field, arcs in _table1_profile(tables, teeth).items():
        put(f"profile.{field}", arcs, f"{tables.table1.place}; cells of {file}", "printed")
        changes["profile"][field]["unit"] = "m, m, m, 1"
    return changes


def _lengths(tables: PaperTables, teeth: int, assumed: float) -> tuple[float, float]:
    """Pin to pin lengths (m) of link and connector; the link's is ``assumed`` if the cells do not tell it."""
    link, connector, pitch, circle = (tables.value(name) for name in LENGTHS)
    if link is None:
        link = assumed
        if connector is not None and (pitch or circle) is not None:
            link = pitch - connector if pitch else connector_length(teeth, connector, circle)
    if connector is None:
        connector = pitch - link if pitch else connector_length(teeth, link, circle)
    if not (link > 0 and connector > 0):
        raise InputError(
            f"parameters.pitch = {pitch:g} m leaves no length for link ({link:.6g} m) and connector ({connector:.6g} m)"
            "; a longer pitch is accepted"
        )
    polygon = equal_pitch_radius(teeth, link, connector, 0.0)["polygonal"]
    off = TANGENT + 3 * half_unit(filter(None, map(tables.value, LENGTHS)))
    for name, value, made in (("pitch", pitch, link + connector), ("r_p", circle, hypot(polygon, link / 2))):
        if value is not None and abs(value - made) > off:
            raise InputError(
                f"parameters.{name} = {value:g} m is not that of link and connector, {link:.6g} + {connector:.6g} m, "
                f"which give {made:.6g} m; lengths that agree, or one of them less, are accepted"
            )
    return link, connector
