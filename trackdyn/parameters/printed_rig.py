"""What the article's cells that a reader filled in (`paper_tables`) say of a rig: groove, lengths, values."""

from difflib import get_close_matches
from math import atan2, cos, degrees, hypot, pi, sin, sqrt
from typing import Any

import numpy as np

from trackdyn.errors import InputError, shown
from trackdyn.parameters.groove import Groove, connector_length, equal_pitch_radius
from trackdyn.parameters.outline import TANGENT, flank_arcs, groove_of_arcs
from trackdyn.parameters.paper_tables import (
    AXIAL,
    FACTORS,
    LENGTHS,
    OWN,
    SIGNS,
    PaperTables,
    groove_rows,
    half_unit,
    value_of,
)
from trackdyn.parameters.quantities import number_of


def groove_of_table1(tables: PaperTables, teeth: int) -> Groove | None:
    """The groove that Table 1 prints, or None if it is empty.

    Neighbours join with a common tangent: what the cells leave open within their last decimal is closed by keeping the
    printed radii of areas 2 to 5, the directions in which the printed centres lie from each other, and the height of
    area 5. Raises `InputError`: arcs do not join within the rounding of the cells, or u, theta and r_a are not those of
    the arcs.
    """
    rows = groove_rows(tables.table1)
    if rows is None:
        return None
    centre, radius, off = rows
    slopes, reaches = [], []
    for i in range(4):
        between, reach = centre[i + 1] - centre[i], SIGNS[i] * radius[i] - SIGNS[i + 1] * radius[i + 1]
        miss = abs(hypot(*between) - abs(reach))
        if miss > off or reach == 0:
            raise InputError(
                f"table1: areas {i + 1} and {i + 2} do not join, by {1e3 * miss:.3g} mm: their centres are "
                f"{1e3 * hypot(*between):.6g} mm apart and arcs with a common tangent are accepted, "
                f"{1e3 * abs(reach):.6g} mm apart for these radii"
            )
        slopes.append(atan2(between[0] / reach, between[1] / reach))
        reaches.append(abs(reach))
    half = pi / teeth
    across = abs(centre[0, 0] * cos(half) + centre[0, 1] * sin(half))
    for area, miss, line in (
        (1, across, "the middle of its tooth"),
        (5, abs(centre[4, 0]), "the middle of the groove"),
    ):
        if miss > off:
            raise InputError(
                f"table1.areas.{area}.O_x: the centre at x = {1e3 * centre[area - 1, 0]:.6g} mm "
                f"lies {1e3 * miss:.3g} mm off {line}; one on that line, x <= 0 for areas 1 to 5, is accepted"
            )
    arcs = flank_arcs(SIGNS, radius[1:], np.array(slopes), float(centre[4, 1]), teeth)
    try:
        groove = groove_of_arcs(arcs, teeth)
    except InputError as error:
        raise InputError(f"table1: {str(error).removeprefix('profile.arcs: ')}") from None
    _refuse_angles(tables, groove, off / min(reaches))
    printed = value_of(tables, "r_a")
    if printed is not None and abs(printed - groove.addendum) > off + half_unit([printed]):
        raise InputError(
            f"parameters.r_a = {printed:g} m is not the addendum circle of Table 1, {groove.addendum:.6g} m: a table "
            "and a radius that agree, or one of them alone in Table 1, are accepted"
        )
    return groove


def _refuse_angles(tables: PaperTables, groove: Groove, off: float) -> None:
    """Refuse directions and spread angles that are not those of the arcs; ``off`` (rad) is what rounding may do."""
    table = tables.table1
    for name, found, scale in (
        ("u_x", groove.direction[:, 0], 1.0),
        ("u_y", groove.direction[:, 1], 1.0),
        ("theta", groove.half_angle, FACTORS[table.units.theta]),
    ):
        cells = {area: value for area, row in table.areas.items() if (value := getattr(row, name)) is not None}
        for area, value in cells.items():
            if abs(scale * value - found[area - 1]) > off + scale * half_unit(cells.values()):
                raise InputError(
                    f"table1.areas.{area}.{name} = {value:g} is not what centres and radii give, "
                    f"{found[area - 1] / scale:.5g}; cells that agree, or null, are accepted"
                )


def with_cells(data: dict, tables: PaperTables, file: str) -> dict:
    """Contents of a rig file (`rig_file.read_rig`) with what the cells say of the rig in place of what it had.

    ``data`` are sections of entries ``{value, unit, kind, source}``, ``file`` is the name under which refusals and
    sources speak of the cells. Raises `InputError`: one sentence with file, field, value and what is accepted.
    """
    try:
        return _with_cells(data, tables, file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _with_cells(data: dict, tables: PaperTables, file: str) -> dict:
    data = {key: dict(part) if isinstance(part, dict) else part for key, part in data.items()}

    def put(name: str, value: Any, kind: str, source: str) -> None:
        section, _, field = name.partition(".")
        entries = data[section] if field else data
        kept = {key: part for key, part in entries.get(field or section, {}).items() if key in ("low", "high", "unit")}
        entries[field or section] = {**kept, "value": value, "kind": kind, "source": source}

    known = [f"{key}.{field}" for key, part in data.items() if isinstance(part, dict) for field in part]
    for name, entry in tables.parameters.items():
        if name in OWN or entry.value is None:
            continue  # what is not filled in is not held against a rig that may be another one
        if name not in known:
            near = get_close_matches(name, [*known, *OWN], 1)
            meant = f"did you mean {near[0]!r}?" if near else "a name such as chain.link_mass is accepted"
            raise InputError(f"parameters.{shown(name)} is not a parameter of this rig; {meant}")
        section, field = name.split(".")
        unit = data[section][field].get("unit") if isinstance(data[section][field], dict) else None
        if unit != entry.unit:
            raise InputError(f"parameters.{name} has the unit {shown(entry.unit)}; it must be given in {unit!r}")
        put(name, entry.value, "printed", f"{entry.place}; a cell of {file}")

    def number(name: str) -> float:
        section, field = name.split(".")
        entry = (data.get(section) or {}).get(field) if isinstance(data.get(section) or {}, dict) else None
        return number_of(entry.get("value") if isinstance(entry, dict) else None)

    thick, thin = (
        sorted((value_of(tables, name) for name in AXIAL), reverse=True) if value_of(tables, "t_S") else (0, 0)
    )
    if thick:
        put("tooth_contact.contact_length", thin, "derived", f"the smaller one of t_S and t_C, Eq. 19; cells of {file}")
        put("tooth_contact.axial_overhang", (thick - thin) / 2, "derived", f"(t_S - t_C) / 2, Eq. 19; cells of {file}")
    teeth = number("sprocket.teeth")
    if not (teeth >= 5 and teeth == int(teeth)):
        return data  # refused where the rig is read
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
    groove = groove_of_table1(tables, int(teeth))
    if groove is not None:
        arc_radius, link = number("chain.connector_radius"), number("chain.link_length")
        middle = number("sprocket.equal_pitch_radius") + thickness / 2
        pin_circle = hypot(middle, link / 2)
        narrow = groove.radius[~groove.convex].min()
        if narrow <= arc_radius:
            raise InputError(
                f"table1: a concave area has the radius {narrow:.6g} m; it must be wider than the connector's arc, "
                f"chain.connector_radius = {arc_radius:g} m"
            )
        data.pop("profile", None)
        design = _design(groove, pin_circle, connector_length(int(teeth), link, pin_circle), arc_radius)
        data["groove"] = {key: dict(entry) for key, entry in data.get("groove", {}).items()}
        for name, value in design.items():
            unit = "deg" if name.startswith("slope") else "m"
            data["groove"].setdefault(name, {})["unit"] = unit
            kind = "printed" if name in ("r2", "r3", "r4", "r5") else "derived"
            put(f"groove.{name}", value, kind, f"{tables.table1.place}; cells of {file}")
    return data


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


def _design(groove: Groove, pin_circle: float, connector: float, arc_radius: float) -> dict[str, float]:
    """What `groove.build_groove` makes a groove of ten arcs from, slopes in degrees, lengths in m."""
    r = dict(zip(("r2", "r3", "r4", "r5"), groove.radius[1:5].tolist(), strict=True))
    slopes = {}
    for name, i in (("slope_tip", 0), ("slope_seat", 1), ("slope_low", 2), ("slope_bottom", 3)):
        between = groove.centre[i + 1] - groove.centre[i]
        reach = SIGNS[i] * groove.radius[i] - SIGNS[i + 1] * groove.radius[i + 1]
        slopes[name] = atan2(between[0] / reach, between[1] / reach)
    seat = groove.centre[2, 1] - (r["r3"] - arc_radius)  # height of an arc's centre that rests on area 3
    depth = sqrt(pin_circle**2 - connector**2 / 4) - seat
    return {"seat_depth": depth, **{name: degrees(value) for name, value in slopes.items()}, **r}
